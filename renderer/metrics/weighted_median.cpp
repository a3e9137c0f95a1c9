#include "renderer/metrics/weighted_median.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace helio {

Result<double> weighted_median(std::span<const float> errors) {
  if (errors.empty()) return Error{ErrorCode::invalid_argument, "is empty", "error map"};
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (std::isfinite(errors[i]) && errors[i] >= 0) continue;
    return Error{ErrorCode::invalid_argument, std::to_string(errors[i]) + ", must be finite and not negative",
                 "error map[" + std::to_string(i) + "]"};
  }
  std::vector<float> sorted(errors.begin(), errors.end());
  std::sort(sorted.begin(), sorted.end());
  double total = 0;
  for (const float error : sorted) total += error;
  double below = 0;
  for (const float error : sorted) {
    below += error;
    if (below >= 0.5 * total) return double(error);
  }
  return double(sorted.back());  // not reached: the last sum is the total
}

}  // namespace helio
