// Two ways of making the same picture, each in independent batches, held against each other.
//
// What light paths bring to one pixel is correlated with what they bring to others, so the variance of a tile is not
// the sum of its pixels'. Batches know nothing of it: a picture is made a few dozen times with other random numbers,
// and of any region the scatter over the batches is that of its mean. Sobol's gain is in it, too.
//
// The two means of a region differ by Welch's t (1947) with the degrees of freedom of his eq. 28, which is mapped to
// a standard normal z (Wallace 1959, "Bounds on normal approximations to Student's and the chi-square distributions",
// right far into the tails); bounds on z are those of z_test.h.
#pragma once

#include <string>
#include <vector>

#include "renderer/base/math.h"

namespace helio::test {

struct Batches {
  int width = 0, height = 0;
  std::vector<std::vector<V3d>> pictures;  // by batch, by row
};

struct BatchComparison {
  double pixels_inside = 0;    // share of pixel channels inside their bound
  double worst_tile = 0;       // largest |z| of an 8 x 8 tile over its bound
  double worst_edge = 0;       // the same of the first and last row and column
  double worst_mean = 0;       // the same of the whole picture over 3
  double mean_off = 0;         // of the whole: largest relative difference of a channel,
  double standard_error = 0;   // and its standard error, relative, where that is largest
  int tile_x = 0, tile_y = 0;  // of the worst tile
  bool passed() const;
  std::string to_string() const;
};

// Of one size, each of at least two batches. A region is allowed kRounding of its level for the rounding of floats
// and the offsets of rays; a pixel kRelativeFloor as in z_test.h.
BatchComparison compare(const Batches& rendering, const Batches& reference);

inline constexpr int kBatchTile = 8;
inline constexpr double kRounding = 1e-4;

}  // namespace helio::test
