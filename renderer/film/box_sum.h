// Sums over the 7x7 neighbourhood of every pixel, in an order that depends on nothing but the neighbourhood.
#pragma once

#include <vector>

#include "renderer/base/math.h"

namespace helio {

inline constexpr int kBoxRadius = 3;

// Four floats a pixel, so that one pixel is one vector: three channels and a weight.
inline constexpr int kBoxLanes = 4;

// Rows of pixels of kBoxLanes floats.
struct BoxPlane {
  std::vector<float> data;
  int stride = 0;  // floats per row

  void resize(int width, int height) {
    stride = width * kBoxLanes;
    data.resize(std::size_t(stride) * height);
  }
  void clear(int width, int height) {
    resize(width, height);
    std::fill(data.begin(), data.end(), 0.0f);
  }
  float* row(int y) { return data.data() + std::size_t(y) * stride; }
  const float* row(int y) const { return data.data() + std::size_t(y) * stride; }
};

// The window and the border that its neighbourhoods reach into.
inline PixelRect with_box_border(const PixelRect& window) {
  return {window.x0 - kBoxRadius, window.y0 - kBoxRadius, window.x1 + kBoxRadius, window.y1 + kBoxRadius};
}

// `in` covers the window with its border, width x height is the size of the window and of `out`; `rows` is scratch.
// Pixels that shall not count are zero in `in`.
void box_sum(const BoxPlane& in, int width, int height, BoxPlane& rows, BoxPlane& out);

}  // namespace helio
