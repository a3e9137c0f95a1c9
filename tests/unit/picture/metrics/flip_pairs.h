// Pairs of pictures that FLIP is compared on with flip-evaluator: made by formula from whole numbers, so that anyone
// gets the same floats.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/unit/picture/metrics/test_picture.h"

namespace helio::test {

// In [0, 1), of 24 bits.
inline float hashed(std::uint32_t x, std::uint32_t y, std::uint32_t k) {
  std::uint32_t v = (x * 73856093u) ^ (y * 19349663u) ^ (k * 83492791u);
  v = (v ^ (v >> 16)) * 0x45d9f3bu;
  v = (v ^ (v >> 16)) * 0x45d9f3bu;
  return float((v ^ (v >> 16)) >> 8) * 0x1p-24f;
}

struct FlipPair {
  std::string name;
  bool hdr;
  Picture picture, reference;
};

// value(x, y, channel) of every pixel.
template <class Value>
Picture made_by(int width, int height, const Value& value) {
  Picture picture(width, height, 0.0f);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x)
        picture.channels[c][std::size_t(y * width + x)] = value(std::uint32_t(x), std::uint32_t(y), std::uint32_t(c));
    }
  }
  return picture;
}

// Ramps and tiles of 8 x 8 pixels, in [0, 1].
inline float tiles(std::uint32_t x, std::uint32_t y, std::uint32_t c) {
  return 0.25f * float(x % 32) / 32 + 0.25f * float(y % 16) / 16 + 0.5f * hashed(x / 8, y / 8, c);
}
// The same over 12 stops.
inline float bright_tiles(std::uint32_t x, std::uint32_t y, std::uint32_t c) {
  return 0.01f * std::exp2(12 * tiles(x, y, c));
}

inline std::vector<FlipPair> flip_pairs() {
  const int w = 75, h = 50;
  const auto noise = [](std::uint32_t x, std::uint32_t y, std::uint32_t c) { return hashed(x, y, c + 10) - 0.5f; };
  const auto with_sun = [](std::uint32_t x, std::uint32_t y, std::uint32_t c) {
    return x == 37 && y == 20 ? 1e5f : bright_tiles(x, y, c);
  };
  return {
      {"noise", false, made_by(w, h, [&](auto x, auto y, auto c) { return tiles(x, y, c) + 0.2f * noise(x, y, c); }),
       made_by(w, h, tiles)},
      {"one pixel aside", false, made_by(w, h, [](auto x, auto y, auto c) { return tiles(x + 1, y, c); }),
       made_by(w, h, tiles)},
      {"other hues", false, made_by(w, h, [](auto x, auto y, auto c) { return tiles(x, y, (c + 1) % 3); }),
       made_by(w, h, tiles)},
      {"white dots", false,
       made_by(w, h, [](auto x, auto y, auto c) { return hashed(x, y, 7) < 0.01f ? 1.0f : tiles(x, y, c); }),
       made_by(w, h, tiles)},
      {"noise over 12 stops", true,
       made_by(w, h, [&](auto x, auto y, auto c) { return bright_tiles(x, y, c) * (1 + noise(x, y, c)); }),
       made_by(w, h, bright_tiles)},
      {"a sun, a third too dark", true,
       made_by(w, h, [&](auto x, auto y, auto c) { return 0.667f * with_sun(x, y, c); }), made_by(w, h, with_sun)},
      {"fireflies in the dark", true,
       made_by(w, h, [](auto x, auto y, auto) { return hashed(x, y, 8) < 0.005f ? 50.0f : 0.002f; }),
       made_by(w, h, [](auto x, auto, auto) { return x < 20 ? 0.5f : 0.002f; })},
  };
}

}  // namespace helio::test
