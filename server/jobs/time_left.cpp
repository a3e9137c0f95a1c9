#include "server/jobs/time_left.h"

#include <algorithm>
#include <cmath>

namespace helio {
namespace {

constexpr double kFewestSamples = 16;
// The error of Monte Carlo falls as n^-1/2; Sobol points do better where the picture is smooth, up to n^-1 at edges.
constexpr double kSlowest = 0.5, kFastest = 1.0;
// What the interval allows for: an estimate of the error is off by so much (standard deviation, of its logarithm), the
// exponent by so much, and the rate of samples by so much.
constexpr double kErrorSpread = 0.03, kExponentSpread = 0.06, kRateSpread = 0.05;
constexpr double kFourOfFive = 1.2816;  // standard deviations that hold four fifths of a normal distribution

double error_of(const FilmError& error) {
  return std::hypot(error.rmse, error.hidden_rmse);
}

// Of the newest points, by least squares in the logarithms.
double exponent(const std::vector<ErrorCurve::Point>& points) {
  const double newest = points.back().samples;
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const ErrorCurve::Point& point : points) {
    if (point.samples * 16 < newest) continue;
    const double x = std::log(point.samples), y = std::log(point.error);
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  const double spread = n * sxx - sx * sx;
  if (n < 3 || !(spread > 1e-9)) return kSlowest;
  return std::clamp(-(n * sxy - sx * sy) / spread, kSlowest, kFastest);
}

}  // namespace

void ErrorCurve::add(const FrameProgress& progress) {
  const double error = error_of(progress.error);
  const double samples = progress.samples_per_pixel;
  if (!progress.error.known || !(error > 0) || !std::isfinite(error) || samples < 2) return;
  if (!points_.empty() && (points_.back().error == error || points_.back().samples >= samples)) return;
  if (points_.size() == kMostPoints) points_.erase(points_.begin());
  points_.push_back({samples, error});
}

std::optional<TimeLeft> time_left(const FrameProgress& progress, const Budget& budget, const ErrorCurve& curve) {
  std::optional<TimeLeft> left;
  const auto first = [&](const TimeLeft& other) {
    if (!left || other.seconds < left->seconds) left = other;
  };
  if (budget.time_s) {
    const double seconds = std::max(0.0, *budget.time_s - progress.seconds);
    first({seconds, seconds, seconds});
  }
  const double samples = progress.samples_per_pixel;
  if (samples < kFewestSamples || !(progress.seconds > 0)) return left;
  const double per_sample = progress.seconds / samples;
  if (budget.samples) {
    const double seconds = std::max(0.0, *budget.samples - samples) * per_sample;
    const double off = kFourOfFive * kRateSpread;
    first({seconds, seconds * (1 - off), seconds * (1 + off)});
  }
  if (budget.error && !curve.points().empty()) {
    const ErrorCurve::Point& at = curve.points().back();
    const double p = exponent(curve.points());
    const double fall = std::max(0.0, std::log(at.error / *budget.error));
    const double wanted = std::log(at.samples) + fall / p;
    const double spread = std::hypot(kErrorSpread / p, fall * kExponentSpread / (p * p), kRateSpread);
    const auto seconds = [&](double log_samples) {
      return std::max(0.0, std::exp(std::min(log_samples, 700.0)) - samples) * per_sample;
    };
    const TimeLeft by_error{seconds(wanted), seconds(wanted - kFourOfFive * spread),
                            seconds(wanted + kFourOfFive * spread)};
    if (std::isfinite(by_error.high_s)) first(by_error);
  }
  return left;
}

}  // namespace helio
