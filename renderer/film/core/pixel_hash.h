// Random bits of a pixel, for decisions about it that are not samples.
#pragma once

#include <cstdint>

namespace helio {

// The finaliser of splitmix64 (Steele et al. 2014).
inline std::uint64_t mix_bits(std::uint64_t z) {
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return z ^ z >> 31;
}

inline std::uint64_t pixel_bits(int x, int y) {
  return std::uint64_t(std::uint32_t(y)) << 32 | std::uint32_t(x);
}

// In [0, 1), of the pixel: decides between two counts.
inline float dither(int x, int y, std::uint64_t seed) {
  return float(mix_bits(pixel_bits(x, y) + seed * 0x9e3779b97f4a7c15u) >> 40) * 0x1p-24f;
}

}  // namespace helio
