// A picture as FLIP's observer sees it: filtered by contrast sensitivity, with the strength of edges and points.
#pragma once

#include <vector>

#include "renderer/metrics/flip_kernels.h"
#include "renderer/metrics/flip_tone_mapping.h"

namespace helio {

// Filters a picture row by row, top row first: holds as many rows as the filters are high, no whole plane. Beyond the
// border the picture goes on with its outermost pixels.
class FlipFilter {
 public:
  // One pixel each; rows are padded to whole blocks, whose surplus values mean nothing.
  struct Row {
    std::vector<float> y, cx, cz;    // filtered, in units of white: Y, X - Y, Y - Z
    std::vector<float> edge, point;  // lengths of the first and second derivative of Y
  };

  FlipFilter(const FlipKernels& kernels, int width, int height);

  // Row y, [0, height), one after the other; with row 0 another picture begins. `rows`: the picture, in [0, 1].
  const Row& row(int y, const FlipRows& rows);

 private:
  // Filtered across; blue-yellow twice, and Y as it is needed for each derivative.
  enum Plane { kY, kCx, kCz0, kCz1, kGaussian, kFirst, kSecond, kPlanes };

  void filter_across(int y);
  void filter_down(int y);
  float* stored(Plane plane, int y);

  const FlipKernels& kernels_;
  int width_, height_, radius_;
  int blocks_;       // of a row
  int filled_ = 0;   // rows that were filtered across
  float* color_[3];  // into color_row_
  std::vector<float> color_row_;
  std::vector<float> opponent_[3];    // Y, X - Y, Y - Z of one row, with radius_ values more at both ends
  std::vector<float> rows_;           // the last 2 radius_ + 1 rows of all planes
  std::vector<const float*> around_;  // rows y - radius_ to y + radius_ of a plane
  Row row_;
};

}  // namespace helio
