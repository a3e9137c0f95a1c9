#include "server/jobs/time_left.h"

#include <algorithm>
#include <cmath>

namespace helio {
namespace {

constexpr double kFewestSamples = 16;
// The error of Monte Carlo falls as n^-1/2; Sobol points do better where the picture is smooth, up to n^-1 at edges.
// Over 40 pictures of the project's scenes, from 16 samples to their ends, exponents are 0.65 with this deviation.
// The fit weighs a curve against that by kErrorSpread, the standard deviation of the logarithm of an error estimate; the
// exponent to come differs from the one so far by kChange.
constexpr double kSlowest = 0.5, kFastest = 1.0;
constexpr double kUsual = 0.65, kUsualSpread = 0.1, kChange = 0.05;
constexpr double kErrorSpread = 0.1;
// Standard deviation of the logarithm of the rate of samples, and seconds that the beginning may take besides.
constexpr double kRateSpread = 0.1, kStartSeconds = 0.01;
constexpr double kLongest = 1e9;         // seconds: what lies beyond 30 years is no end in sight
constexpr double kFourOfFive = 1.2816;  // standard deviations that hold four fifths of a normal distribution

double error_of(const FilmError& error) {
  return std::hypot(error.rmse, error.hidden_rmse);
}

// Of the errors to come, and its standard deviation: by least squares in the logarithms, of points with enough samples,
// after what is usual; few points near each other say little.
struct Exponent {
  double value, spread;
};
Exponent exponent(const std::vector<ErrorCurve::Point>& points) {
  const double newest = points.back().samples;
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const ErrorCurve::Point& point : points) {
    if (point.samples * 64 < newest || point.samples < kFewestSamples) continue;
    const double x = std::log(point.samples), y = std::log(point.error);
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  const double spread = n < 2 ? 0 : sxx - sx * sx / n, slope = n < 2 ? 0 : -(sxy - sx * sy / n);  // slope: times spread
  constexpr double kPrior = (kErrorSpread / kUsualSpread) * (kErrorSpread / kUsualSpread);
  const double value = (slope + kPrior * kUsual) / (spread + kPrior);
  return {std::clamp(value, kSlowest, kFastest), std::hypot(kErrorSpread / std::sqrt(spread + kPrior), kChange)};
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

std::optional<TimeLeft> time_left(const FrameProgress& progress, double pixels, const Budget& budget,
                                  const ErrorCurve& curve) {
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
  // Of samples that are complete everywhere there may be half as many as there are by now. The live rate is of this
  // attempt alone, which has just begun if it is the slower one.
  double per_sample = progress.seconds / samples;
  if (progress.samples_per_second > 0) per_sample = std::min(per_sample, pixels / progress.samples_per_second);
  if (budget.samples) {
    const double seconds = std::max(0.0, *budget.samples - samples) * per_sample;
    const double off = kFourOfFive * kRateSpread;
    first({seconds, seconds * (1 - off), seconds * (1 + off)});
  }
  if (budget.error && !curve.points().empty()) {
    const ErrorCurve::Point& at = curve.points().back();
    const auto [p, p_spread] = exponent(curve.points());
    const double fall = std::max(0.0, std::log(at.error / *budget.error));
    const double wanted = std::log(at.samples) + fall / p;
    const double rate_spread = std::hypot(kRateSpread, kStartSeconds / progress.seconds);
    const double spread = std::hypot(kErrorSpread / p, fall * p_spread / (p * p), rate_spread);
    const auto seconds = [&](double log_samples) {
      return std::max(0.0, std::exp(std::min(log_samples, 700.0)) - samples) * per_sample;
    };
    const TimeLeft by_error{seconds(wanted), seconds(wanted - kFourOfFive * spread),
                            seconds(wanted + kFourOfFive * spread)};
    if (by_error.high_s < kLongest) first(by_error);
  }
  return left;
}

}  // namespace helio
