#include "renderer/comparison/interval.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "renderer/comparison/student_t.h"

namespace helio {
namespace {

constexpr double kLeastLogSkewness = -1.4;

struct Moments {
  double mean = 0;
  double variance = 0;  // unbiased
  double skewness = 0;  // 0 without variance
};

Moments moments(std::span<const double> values) {
  const double n = double(values.size());
  double sum = 0, squares = 0, cubes = 0;
  for (const double v : values) sum += v;
  Moments result;
  result.mean = sum / n;
  for (const double v : values) {
    const double d = v - result.mean;
    squares += d * d;
    cubes += d * d * d;
  }
  result.variance = squares / (n - 1);
  const double cubed_deviation = std::pow(squares / n, 1.5);
  if (cubed_deviation > 0) result.skewness = cubes / n / cubed_deviation;
  return result;
}

}  // namespace

Interval mean_interval(std::span<const double> values) {
  if (values.empty()) return {};
  const auto [smallest, largest] = std::minmax_element(values.begin(), values.end());
  const bool enough = values.size() >= std::size_t(kLeastSeeds);
  if (*smallest == *largest) return enough ? Interval{*smallest, *smallest, *smallest, true} : Interval{*smallest};

  // In units of the largest one no square overflows.
  const double unit = std::max(std::abs(*smallest), std::abs(*largest));
  std::vector<double> scaled(values.begin(), values.end());
  for (double& v : scaled) v /= unit;
  const Moments plain = moments(scaled);
  if (!enough) return {plain.mean * unit};

  const double n = double(values.size()), t = student_t_95(int(values.size()) - 1);
  const double half = t * std::sqrt(plain.variance / n);
  double low = plain.mean - half, high = plain.mean + half;
  if (*smallest > 0) {
    std::vector<double> logs(values.begin(), values.end());
    const double log_unit = std::log(unit);
    for (double& v : logs) v = std::log(v) - log_unit;
    const Moments log = moments(logs);
    if (log.skewness > kLeastLogSkewness) {
      const double middle = log.mean + log.variance / 2;
      const double log_half = t * std::sqrt(log.variance / n + log.variance * log.variance / (2 * (n - 1)));
      low = std::min(std::exp(middle - log_half), plain.mean);
      high = std::max(high, std::exp(middle + log_half));
    }
  }
  const Interval interval{plain.mean * unit, low * unit, high * unit, true};
  return std::isfinite(interval.low) && std::isfinite(interval.high) ? interval : Interval{interval.mean};
}

Interval cut(Interval interval, double low, double high) {
  if (!interval.known) return interval;
  interval.low = std::min(std::max(interval.low, low), interval.mean);
  interval.high = std::max(std::min(interval.high, high), interval.mean);
  return interval;
}

Interval widened(Interval interval, double standard_error) {
  constexpr double kNormal95 = 1.959964;
  if (!interval.known) return interval;
  const double more = kNormal95 * standard_error;
  interval.low = interval.mean - std::hypot(interval.mean - interval.low, more);
  interval.high = interval.mean + std::hypot(interval.high - interval.mean, more);
  return interval;
}

}  // namespace helio
