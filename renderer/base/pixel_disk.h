// Pixels of a picture around a point, or all others.
#pragma once

#include <algorithm>
#include <cmath>

namespace helio {

struct PixelDisk {
  double x = 0, y = 0, radius = 0;  // pixels from the picture's upper left corner
  bool outside = false;             // all pixels but those whose centres are nearer than the radius

  bool contains(int pixel_x, int pixel_y) const {
    return (std::hypot(pixel_x + 0.5 - x, pixel_y + 0.5 - y) < radius) != outside;
  }
  // At least one of a picture of this size: the nearest centre is asked, or, of what is outside, the farthest.
  bool has_pixels(int width, int height) const {
    const auto offset = [this](double at, int pixels) {
      if (outside) return std::max(std::abs(at - 0.5), std::abs(pixels - 0.5 - at));
      return std::abs(at - std::clamp(std::floor(at) + 0.5, 0.5, pixels - 0.5));
    };
    return (std::hypot(offset(x, width), offset(y, height)) < radius) != outside;
  }
};

}  // namespace helio
