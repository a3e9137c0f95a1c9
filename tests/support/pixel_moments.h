// Both halves of a pixel taken as one lot of samples.
#pragma once

#include <algorithm>

#include "renderer/film/core/film.h"

namespace helio::test {

struct PixelMoments {
  double count = 0;
  V3d mean{0, 0, 0};  // 0 without samples
  // Of the mean, as that of independent samples: never below that of Sobol points. 0 for fewer than two.
  V3d variance{0, 0, 0};
};

inline PixelMoments moments_of(const Film& film, int x, int y) {
  PixelMoments m;
  V3d sum(0, 0, 0), squares(0, 0, 0);
  for (int h = 0; h < kHalves; ++h) {
    const HalfPixel& half = film.half(h, x, y);
    m.count += half.count;
    for (int c = 0; c < 3; ++c) {
      sum[c] += half.sum[c];
      squares[c] += half.sum_squares(c);
    }
  }
  if (m.count == 0) return m;
  m.mean = sum / m.count;
  for (int c = 0; c < 3 && m.count > 1; ++c)
    m.variance[c] = std::max(0.0, squares[c] / m.count - m.mean[c] * m.mean[c]) / (m.count - 1);
  return m;
}

}  // namespace helio::test
