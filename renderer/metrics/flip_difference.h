// FLIP of two rows as its observer sees them.
#pragma once

#include <vector>

#include "renderer/metrics/flip_observer.h"

namespace helio {

class FlipDifference {
 public:
  explicit FlipDifference(int width);

  // error[i] = max(error[i], FLIP of pixel i), each in [0, 1].
  void add(const ObservedRow& picture, const ObservedRow& reference, float* error);

 private:
  float largest_;  // difference of colours, to the power of its exponent
  std::vector<float> color_, feature_;
};

}  // namespace helio
