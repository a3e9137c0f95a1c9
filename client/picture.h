// A picture on the client: named planes of floats over a rectangle of the frame.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/math.h"

namespace helio {

struct Picture {
  int frame_width = 0, frame_height = 0;   // pixels of the whole frame
  PixelRect window;                        // what the planes cover
  std::vector<std::string> names;          // "R", "variance.G", "samples", ...
  std::vector<std::vector<float>> planes;  // as names; window.area() floats each, row-major, top row first

  const std::vector<float>* find(std::string_view name) const {
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (names[i] == name) return &planes[i];
    }
    return nullptr;
  }
  bool empty() const { return planes.empty(); }
};

}  // namespace helio
