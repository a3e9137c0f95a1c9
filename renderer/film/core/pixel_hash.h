// Random bits of a pixel, for decisions about it that are not samples.
#pragma once

#include <cstdint>

#include "renderer/base/hash.h"

namespace helio {

inline std::uint64_t pixel_bits(int x, int y) {
  return std::uint64_t(std::uint32_t(y)) << 32 | std::uint32_t(x);
}

// In [0, 1), of the pixel: decides between two counts.
inline float dither(int x, int y, std::uint64_t seed) {
  return float(hash64(pixel_bits(x, y) + seed * 0x9e3779b97f4a7c15u) >> 40) * 0x1p-24f;
}

}  // namespace helio
