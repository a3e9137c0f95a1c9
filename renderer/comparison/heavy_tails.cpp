#include "renderer/comparison/heavy_tails.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "renderer/base/check.h"
#include "renderer/comparison/interval.h"

namespace helio {
namespace {

constexpr double kMostOfTheError = 0.5;
// Thresholds of the difference of log likelihoods, found by simulation (tests/unit/picture/comparison).
constexpr double kClearDifference = 1.3;
constexpr std::size_t kSensitiveFrom = 10;  // seeds
constexpr std::size_t kSignedFrom = 8;      // seeds
constexpr double kFarDeviation = 12;

double sensitive_threshold(std::size_t seeds) {
  return std::min(0.0, -2.3 + 0.2 * (double(seeds) - double(kSensitiveFrom)));
}

// Errors divided by the largest: those with 0 in place of what is negative.
std::vector<double> weights_of(std::span<const double> errors) {
  std::vector<double> weights(errors.begin(), errors.end());
  double largest = 0;
  for (const double w : weights) largest = std::max(largest, w);
  for (double& w : weights) w = largest > 0 ? std::max(0.0, w / largest) : 1;
  return weights;
}

bool pixels_say_so(std::span<const double> errors, std::span<const double> shares) {
  const std::vector<double> weights = weights_of(errors);
  double error = 0, of_outliers = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    error += weights[i];
    of_outliers += weights[i] * shares[i];
  }
  const std::size_t worst = std::size_t(std::max_element(errors.begin(), errors.end()) - errors.begin());
  return shares[worst] >= kMostOfTheError || of_outliers >= kMostOfTheError * error;
}

// Log likelihoods of values whose location is not known and integrated over; what is common to both is left out.
class LogLikelihoods {
 public:
  explicit LogLikelihoods(std::span<const double> logs) : n_(double(logs.size())) {
    const double smallest = *std::min_element(logs.begin(), logs.end());
    double sum = 0;
    for (const double v : logs) above_smallest_ += v - smallest;
    for (const double v : logs) sum += v;
    for (const double v : logs) squares_ += (v - sum / n_) * (v - sum / n_);
  }

  double exponential(double scale) const {
    return -(n_ - 1) * std::log(scale) - std::log(n_) - above_smallest_ / scale;
  }
  double normal(double sigma) const {
    constexpr double kTwoPi = 6.283185307179586;
    return -(n_ - 1) * (std::log(sigma) + 0.5 * std::log(kTwoPi)) - 0.5 * std::log(n_) - squares_ / (2 * sigma * sigma);
  }

 private:
  double n_, above_smallest_ = 0, squares_ = 0;
};

// How much likelier the logarithms are with a heavy tail than with a light one.
double heavy_over_light(std::span<const double> errors) {
  std::vector<double> logs(errors.begin(), errors.end());
  for (double& v : logs) v = std::log(v);
  const LogLikelihoods likelihoods(logs);
  double heavy = -std::numeric_limits<double>::infinity(), light = heavy;
  // A Pareto tail of exponent a: the logarithm is exponential of scale 1 / a.
  for (const double scale : {1 / 1.5, 0.85, 1.0, 1.4, 2.0, 3.0}) {
    heavy = std::max(heavy, likelihoods.exponential(scale));
  }
  for (const double sigma : {2.5, 3.5, 5.0}) heavy = std::max(heavy, likelihoods.normal(sigma));
  for (const double sigma : {0.2, 0.3, 0.5, 0.7, 1.0}) light = std::max(light, likelihoods.normal(sigma));
  return heavy - light;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return values[(n - 1) / 2] + (values[n / 2] - values[(n - 1) / 2]) / 2;
}

bool one_is_far_off(std::span<const double> errors) {
  std::vector<double> distances(errors.begin(), errors.end());
  const double middle = median(distances);
  for (double& v : distances) v = std::abs(v - middle);
  return *std::max_element(distances.begin(), distances.end()) > kFarDeviation * median(distances);
}

}  // namespace

bool few_pixels_decide(std::span<const double> errors, std::span<const double> outlier_shares) {
  HELIO_CHECK(outlier_shares.empty() || outlier_shares.size() == errors.size());
  if (errors.empty()) return false;
  const bool pixels_known = !outlier_shares.empty();
  if (pixels_known && pixels_say_so(errors, outlier_shares)) return true;

  const std::size_t seeds = errors.size();
  if (seeds < std::size_t(kLeastSeeds)) return false;
  const auto [smallest, largest] = std::minmax_element(errors.begin(), errors.end());
  if (*smallest == *largest) return false;
  if (!(*smallest > 0)) return seeds >= kSignedFrom && one_is_far_off(errors);
  const bool sensitive = !pixels_known && seeds >= kSensitiveFrom;
  return heavy_over_light(errors) > (sensitive ? sensitive_threshold(seeds) : kClearDifference);
}

}  // namespace helio
