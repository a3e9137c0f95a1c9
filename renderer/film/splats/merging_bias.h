// What merging light paths within a disc does to the picture beyond noise: the kernels note, of each block, by how much
// the whole disc brings more than its inner half (BlockWork::bias), and take the bias to grow as the radius does: so it
// is along edges and shadows; within smooth parts it grows as the area, and the estimate is 1.7 times too large. The
// two halves' notes are independent, so that their product is the square of the bias whatever the noise.
#pragma once

#include "renderer/film/core/film.h"

namespace helio {

// Sums over pixels; luminance.
struct MergingBias {
  double pixels = 0;
  double mean[kHalves] = {0, 0};
  double squared = 0;             // of the bias: product of the halves
  double relative = 0;            // over (mean of the block)^2 + epsilon
  double squared_difference = 0;  // of the halves, over blocks weighted by their pixels squared

  void add(const MergingBias& other);
};

// Of the window, in which every pixel has samples in both halves.
MergingBias merging_bias(const Film& film, const PixelRect& window, double epsilon);

}  // namespace helio
