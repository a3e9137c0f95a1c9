// Puts tiles together to a picture.
#pragma once

#include <algorithm>
#include <vector>

#include "renderer/base/math.h"

namespace helio::test {

// One channel of a tile into that of a picture `width` pixels wide; both row-major. A channel that the tile lacks
// leaves the picture as it is.
inline void put_rows(const std::vector<float>& tile, const PixelRect& window, int width, std::vector<float>& picture) {
  if (tile.empty()) return;
  for (int y = window.y0; y < window.y1; ++y) {
    const auto row = tile.begin() + std::ptrdiff_t(y - window.y0) * window.width();
    std::copy_n(row, window.width(), picture.begin() + std::ptrdiff_t(y) * width + window.x0);
  }
}

}  // namespace helio::test
