// One figure for a FLIP map, where its mean would mostly tell how many pixels are right.
#pragma once

#include <span>

#include "renderer/base/result.h"

namespace helio {

// The median of an error map with each pixel weighted by its own error: the smallest value v with
// sum(e of e <= v) >= sum(e) / 2. Pixels without error count nothing, so it tells how large the errors are where there
// are any. 0 when all errors are 0. It is the "weighted median" that flip-evaluator prints (Andersson et al. 2020,
// pooling).
// invalid_argument: an empty map, or a value that is negative or not finite, named by its index.
Result<double> weighted_median(std::span<const float> errors);

}  // namespace helio
