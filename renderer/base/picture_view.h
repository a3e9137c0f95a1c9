// A whole picture of three planar channels that somebody else owns.
#pragma once

#include <cstddef>

namespace helio {

// Linear RGB, row-major, top row first; each channel holds width * height floats.
struct PictureView {
  int width = 0, height = 0;
  const float* channels[3] = {nullptr, nullptr, nullptr};

  std::size_t pixels() const { return width > 0 && height > 0 ? std::size_t(width) * std::size_t(height) : 0; }
};

}  // namespace helio
