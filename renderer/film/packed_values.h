// Small encodings of what a film keeps for every pixel and needs no more digits of.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "renderer/base/math.h"
#include "renderer/film/lanes.h"

namespace helio {

// The upper half of a float: its whole range, 8 significant bits. x >= 0 or +infinity; rounds to nearest.
inline std::uint16_t pack_short_float(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return std::uint16_t(std::min<std::uint32_t>(bits + 0x8000u, 0x7f800000u) >> 16);
}
inline float unpack_short_float(std::uint16_t packed) {
  return std::bit_cast<float>(std::uint32_t(packed) << 16);
}

// Three bytes of a number.
class Packed24 {
 public:
  Packed24() = default;
  Packed24(std::uint32_t low_bits)
      : bytes_{std::uint8_t(low_bits), std::uint8_t(low_bits >> 8), std::uint8_t(low_bits >> 16)} {}
  operator std::uint32_t() const { return std::uint32_t(bytes_[0]) | bytes_[1] << 8 | bytes_[2] << 16; }

 private:
  std::uint8_t bytes_[3] = {0, 0, 0};
};

// A float without its sign and its last seven digits: its whole range, 17 significant bits in 24. x >= 0, finite.
inline std::uint32_t pack_count(float x) {
  return (std::bit_cast<std::uint32_t>(x) + 0x40u) >> 7;
}
inline float unpack_count(std::uint32_t packed) {
  return std::bit_cast<float>(packed << 7);
}

// Three numbers, each in ten bits: zero, or four significant bits in [2^-64, 2^64). Smaller ones and NaN become
// zero, larger ones the largest. Rounded up or down as a hash of the number has it, so that means over pixels stay
// what they were; those of four bits keep their value.
inline constexpr std::uint32_t kShortNumberOffset = (127 - 64) << 3;  // of the exponent and three more bits
inline std::uint32_t pack_short_numbers(float x, float y, float z) {
  const Float4 in = {x, y, z, 0};
  UInt4 bits = (UInt4)(in > 0 ? in : Float4{});
  bits = bits < 0x7f000000u ? bits : UInt4{} + 0x7f000000u;
  bits = (bits + (bits * 0x9e3779b9u >> 12)) >> 20;
  bits = (bits > kShortNumberOffset ? bits : UInt4{} + kShortNumberOffset) - kShortNumberOffset;
  bits = bits < 1023u ? bits : UInt4{} + 1023u;
  return bits[0] | bits[1] << 10 | bits[2] << 20;
}
inline float unpack_short_number(std::uint32_t packed, int i) {
  const std::uint32_t code = packed >> (10 * i) & 1023u;
  return std::bit_cast<float>(code > 0 ? (code + kShortNumberOffset) << 20 : 0u);
}

// A unit vector on an octahedron (Meyer et al. 2010, "On Floating-Point Normal Vectors"), so many bits an axis: of 16
// off by at most 6e-5 radians, of 12 by 1e-3.
template <int kBits = 16>
std::uint32_t pack_direction(const V3f& v) {
  constexpr float kMost = (1 << kBits) - 1;
  const float norm = std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z);
  const float scale = norm > 0 ? 1 / norm : 0;
  float x = v.x * scale, y = v.y * scale;
  if (v.z < 0) {
    const float folded = (1 - std::fabs(y)) * std::copysign(1.0f, x);
    y = (1 - std::fabs(x)) * std::copysign(1.0f, y);
    x = folded;
  }
  const auto unorm = [](float t) { return std::uint32_t(std::lround((t * 0.5f + 0.5f) * kMost)); };
  return unorm(x) | unorm(y) << kBits;
}
template <int kBits = 16>
V3f unpack_direction(std::uint32_t packed) {
  constexpr std::uint32_t kMask = (1u << kBits) - 1;
  const auto axis = [](std::uint32_t bits) { return float(bits) * (2.0f / float(kMask)) - 1; };
  V3f v(axis(packed & kMask), axis(packed >> kBits), 0);
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
