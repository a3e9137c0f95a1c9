// The error that a picture reports, against its true one.
#pragma once

#include "moments.h"
#include "tests/support/loop_views.h"

namespace helio::test {

// The promised range of the reported over the true error after a camera move (goals of tests/bench/reuse.md). Tests hold
// it without an allowance for noise: their seeds are fixed.
inline constexpr double kLeastReported = 0.8, kMostReported = 1.4;

// Of the mean of each pixel and channel, over the picture.
inline double mean_variance(const ViewPicture& picture) {
  double sum = 0;
  for (const auto& channel : picture.variance) {
    for (const float v : channel) sum += double(v);
  }
  return sum / (3.0 * double(picture.variance[0].size()));
}

}  // namespace helio::test
