// Statistics of repeated measurements.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace helio::bench {

// Mean of the two middle values for an even count. Precondition: not empty.
inline double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return (values[(n - 1) / 2] + values[n / 2]) / 2;
}

// Nearest rank: the smallest value that at least `share` (0, 1] of the values do not exceed. Precondition: not empty.
inline double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const auto rank = std::size_t(std::ceil(share * double(values.size())));
  return values[std::clamp<std::size_t>(rank, 1, values.size()) - 1];
}

// Precondition: not empty.
inline double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

// Of the mean of independent values, from their spread. Precondition: two or more.
inline double standard_error(const std::vector<double>& values) {
  const double n = double(values.size()), mean = mean_of(values);
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / (n - 1) / n);
}

}  // namespace helio::bench
