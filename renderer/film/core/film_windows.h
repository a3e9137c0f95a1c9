// Cuts regions of a film into windows for work that is shared.
#pragma once

#include <vector>

#include "renderer/base/math.h"

namespace helio {

// The first multiple of `step` beyond x >= 0.
inline int next_edge(int x, int step) {
  return (x / step + 1) * step;
}

// Windows of at most `columns` x `rows` pixels, aligned to the film in these steps, that make up the region; row by
// row.
inline std::vector<PixelRect> cut_aligned(const PixelRect& region, int columns, int rows) {
  std::vector<PixelRect> windows;
  for (int y = region.y0; y < region.y1; y = next_edge(y, rows)) {
    for (int x = region.x0; x < region.x1; x = next_edge(x, columns))
      windows.push_back(intersect({x, y, next_edge(x, columns), next_edge(y, rows)}, region));
  }
  return windows;
}

}  // namespace helio
