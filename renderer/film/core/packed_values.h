// Small encodings of what a film keeps for every pixel and needs no more digits of.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "renderer/base/math.h"
#include "renderer/film/core/lanes.h"

namespace helio {

// The upper half of a float: its whole range, 8 significant bits. x >= 0 or +infinity; rounds to nearest.
inline std::uint16_t pack_short_float(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return std::uint16_t(std::min<std::uint32_t>(bits + 0x8000u, 0x7f800000u) >> 16);
}
inline float unpack_short_float(std::uint16_t packed) {
  return std::bit_cast<float>(std::uint32_t(packed) << 16);
}

// Means of two halves, finite numbers (of those beyond 1e38 an infinite one may become): of each channel the lower one,
// and by how much the other one is higher in eight significant bits, so that what is lost is a 500th of how far the
// halves are apart and no more than their noise hides.
class PackedMeans {
 public:
  PackedMeans() = default;
  PackedMeans(const Rgb& a, const Rgb& b) {
    for (int c = 0; c < 3; ++c) {
      const bool first = a[c] > b[c];  // is higher
      const float low = first ? b[c] : a[c], more = std::max(first ? a[c] - low : b[c] - low, 0.0f);
      std::memcpy(low_ + 2 * c, &low, sizeof low);
      more_[c] = std::uint16_t(pack_short_float(std::min(more, kMost)) | (first ? 0x8000u : 0u));
    }
  }
  Rgb mean(int half) const {
    Float4 a, b;
    unpack(a, b);
    return half == 0 ? Rgb(a[0], a[1], a[2]) : Rgb(b[0], b[1], b[2]);
  }
  // Three channels each; the fourth lane is 0.
  void unpack(Float4& a, Float4& b) const {
    float low[3];
    std::memcpy(low, low_, sizeof low);
    const Float4 base = {low[0], low[1], low[2], 0};
    const UInt4 codes = {more_[0], more_[1], more_[2], 0};
    const UInt4 more = (codes & 0x7fffu) << 16, first = UInt4{} - (codes >> 15);
    a = base + (Float4)(more & first);
    b = base + (Float4)(more & ~first);
  }

 private:
  static constexpr float kMost = 0x1p127f;

  std::uint16_t low_[6] = {};   // floats; as these the class is no larger than what it holds
  std::uint16_t more_[3] = {};  // above the number: whether the first half is the higher one
};
static_assert(sizeof(PackedMeans) == 18);

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

// The same as a value.
class Float24 {
 public:
  Float24() = default;
  Float24(float x) : bits_(pack_count(x)) {}
  operator float() const { return unpack_count(bits_); }

 private:
  Packed24 bits_;
};

// A number in [0, 254], larger ones become that, by its root in a byte: steps of an eighth at 1 and of 2 at the end, so
// that what grows by ones grows on, if by half too fast at last.
class RootByte {
 public:
  RootByte() = default;
  RootByte(float x) : code_(std::uint8_t(std::min(std::sqrt(std::max(x, 0.0f) * 256) + 0.5f, 255.0f))) {}
  operator float() const { return float(code_) * float(code_) / 256; }

 private:
  std::uint8_t code_ = 0;
};

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
// off by at most 6e-5 radians, of 10 by 4e-3.
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
