// The one-dimensional filters that FLIP is made of. All its two-dimensional filters are products of these, or a sum of
// two such products.
#pragma once

#include <vector>

namespace helio {

// Taps 0, 1, ..., radius of an even filter, or of an odd one (tap 0 is 0; the tap at -i is minus that at i).
using HalfKernel = std::vector<float>;

// Contrast sensitivity (Andersson et al. 2020, colour pipeline: spatial filtering) and feature detection (feature
// pipeline), sampled at whole pixels and cut at three standard deviations of the widest Gaussian, as the authors do.
// Taps of less than 1e-9 of the largest are left out. A vertical pass uses the taps of the horizontal one, but for
// blue-yellow, whose two Gaussians have different weights: `vertical` includes these.
struct FlipKernels {
  HalfKernel achromatic, red_green;
  struct {
    HalfKernel horizontal, vertical;
  } blue_yellow[2];
  // Gaussian of half the width of a feature (0.082 degrees), and its first and second derivative. The Gaussian sums to
  // 1; of a derivative the positive taps sum to 1 and the negative ones to -1.
  HalfKernel gaussian, first, second;

  int radius = 0;  // of the longest, in pixels

  explicit FlipKernels(double pixels_per_degree);
};

}  // namespace helio
