// A small picture that tests of metrics fill.
#pragma once

#include <vector>

#include "renderer/base/picture_view.h"

namespace helio::test {

struct Picture {
  int width, height;
  std::vector<float> channels[3];

  Picture(int w, int h, float value) : width(w), height(h) {
    for (auto& c : channels) c.assign(std::size_t(w) * std::size_t(h), value);
  }
  Picture(int w, int h, float r, float g, float b) : Picture(w, h, r) {
    channels[1].assign(channels[0].size(), g);
    channels[2].assign(channels[0].size(), b);
  }
  PictureView view() const { return {width, height, {channels[0].data(), channels[1].data(), channels[2].data()}}; }
};

}  // namespace helio::test
