// A ratio of two quantities with an interval from the spread over seeds, by the jackknife on logarithms.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "renderer/comparison/interval.h"

namespace helio {

// The logarithm of a quantity, from all seeds and from all but one each. NaN where it does not exist.
struct LogJackknife {
  double whole = 0;
  std::vector<double> without;  // in the order of the seeds
};

// log_value(seed): the logarithm without that seed, of all seeds for nullopt; a double, or NaN.
template <class LogValue>
LogJackknife jackknife(const std::vector<std::uint32_t>& seeds, const LogValue& log_value) {
  LogJackknife result{log_value(std::nullopt), {}};
  for (const std::uint32_t seed : seeds) result.without.push_back(log_value(std::optional(seed)));
  return result;
}

// The ratio of both, mean() the quotient of the quantities themselves. The interval is that of Student's t on the
// logarithm, with the jackknife's variance. paired: both are of the same seeds, in the same order, and a seed is left
// out of both at once; the degrees of freedom are one fewer than the seeds. Else the variances of both are added, with
// Welch's degrees of freedom. Percentiles of a
// bootstrap would be too narrow for few seeds.
//
// None where the ratio does not exist or is not a finite positive number; known is false below kLeastSeeds, and where
// the quantity does not exist without one of the seeds.
std::optional<Interval> log_ratio(const LogJackknife& top, const LogJackknife& bottom, bool paired);

}  // namespace helio
