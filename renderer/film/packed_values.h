// Small encodings of what a film keeps for every pixel and needs no more digits of.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "renderer/base/math.h"

namespace helio {

// The upper half of a float: its whole range, 8 significant bits. x >= 0 or +infinity; rounds to nearest.
inline std::uint16_t pack_short_float(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return std::uint16_t(std::min<std::uint32_t>(bits + 0x8000u, 0x7f800000u) >> 16);
}
inline float unpack_short_float(std::uint16_t packed) {
  return std::bit_cast<float>(std::uint32_t(packed) << 16);
}

// A unit vector on an octahedron (Meyer et al. 2010, "On Floating-Point Normal Vectors"), 16 bits an axis: off by at
// most 6e-5 radians.
inline std::uint32_t pack_direction(const V3f& v) {
  const float norm = std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z);
  const float scale = norm > 0 ? 1 / norm : 0;
  float x = v.x * scale, y = v.y * scale;
  if (v.z < 0) {
    const float folded = (1 - std::fabs(y)) * std::copysign(1.0f, x);
    y = (1 - std::fabs(x)) * std::copysign(1.0f, y);
    x = folded;
  }
  const auto unorm = [](float t) { return std::uint32_t(std::lround((t * 0.5f + 0.5f) * 65535.0f)); };
  return unorm(x) | unorm(y) << 16;
}
inline V3f unpack_direction(std::uint32_t packed) {
  const auto axis = [](std::uint32_t bits) { return float(bits) * (2.0f / 65535.0f) - 1; };
  V3f v(axis(packed & 0xffffu), axis(packed >> 16), 0);
  v.z = 1 - std::fabs(v.x) - std::fabs(v.y);
  const float fold = std::max(-v.z, 0.0f);
  v.x -= std::copysign(fold, v.x);
  v.y -= std::copysign(fold, v.y);
  return v.normalized();
}

// A reflectance, channels in [0, 1] (others become the nearest), ten bits of each one's root: dark ones keep digits.
inline std::uint32_t pack_reflectance(const Rgb& c) {
  const auto channel = [](float x) {
    return std::uint32_t(std::lround(std::sqrt(x > 0 ? std::min(x, 1.0f) : 0.0f) * 1023.0f));
  };
  return channel(c.x) | channel(c.y) << 10 | channel(c.z) << 20;
}
inline Rgb unpack_reflectance(std::uint32_t packed) {
  const auto channel = [](std::uint32_t bits) { return sqr(float(bits & 1023u) / 1023.0f); };
  return {channel(packed), channel(packed >> 10), channel(packed >> 20)};
}

}  // namespace helio
