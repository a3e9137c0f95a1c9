// Vectors that the film is resolved with: an extension of GCC that clang has too. They are split where the machine is
// narrower.
#pragma once

#include <cstdint>
#include <cstring>

namespace helio {

// A pixel is four values, so that it is one vector: three channels and a weight.
inline constexpr int kLanes = 4;

using Double4 = double __attribute__((vector_size(32)));
using Long4 = std::int64_t __attribute__((vector_size(32)));
using Float4 = float __attribute__((vector_size(16)));
using UInt4 = std::uint32_t __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Float8 = float __attribute__((vector_size(32)));
using UInt8 = std::uint32_t __attribute__((vector_size(32)));
using Float16 = float __attribute__((vector_size(64)));  // four pixels
inline constexpr int kPixelsAtOnce = 4;

inline int round_up_to_vectors(int pixels) {
  return (pixels + kPixelsAtOnce - 1) / kPixelsAtOnce * kPixelsAtOnce;
}

// Unaligned.
template <class V>
inline void load(const void* from, V& v) {
  std::memcpy(&v, from, sizeof(v));
}
template <class V>
inline void store(const V& v, void* to) {
  std::memcpy(to, &v, sizeof(v));
}

// Four pixels' fourth lanes, each in all lanes of its pixel.
inline void spread_last(const Float16& pixels, Float16& out) {
  out = __builtin_shufflevector(pixels, pixels, 3, 3, 3, 3, 7, 7, 7, 7, 11, 11, 11, 11, 15, 15, 15, 15);
}

// Four vectors' sums over their lanes.
inline Float4 lane_sums(const Float4 (&of)[4]) {
  const Float4 low =
      __builtin_shufflevector(of[0], of[1], 0, 4, 1, 5) + __builtin_shufflevector(of[0], of[1], 2, 6, 3, 7);
  const Float4 high =
      __builtin_shufflevector(of[2], of[3], 0, 4, 1, 5) + __builtin_shufflevector(of[2], of[3], 2, 6, 3, 7);
  return __builtin_shufflevector(low, high, 0, 1, 4, 5) + __builtin_shufflevector(low, high, 2, 3, 6, 7);
}

// The k-th lanes of all four become the k-th vector.
inline void transpose(UInt4 (&v)[4]) {
  const UInt4 a = __builtin_shufflevector(v[0], v[1], 0, 4, 1, 5), b = __builtin_shufflevector(v[2], v[3], 0, 4, 1, 5);
  const UInt4 c = __builtin_shufflevector(v[0], v[1], 2, 6, 3, 7), d = __builtin_shufflevector(v[2], v[3], 2, 6, 3, 7);
  v[0] = __builtin_shufflevector(a, b, 0, 1, 4, 5);
  v[1] = __builtin_shufflevector(a, b, 2, 3, 6, 7);
  v[2] = __builtin_shufflevector(c, d, 0, 1, 4, 5);
  v[3] = __builtin_shufflevector(c, d, 2, 3, 6, 7);
}

// One channel of four pixels each.
inline void store_planar(const Float16& pixels, float* r, float* g, float* b) {
  const Float16 planar = __builtin_shufflevector(pixels, pixels, 0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
  std::memcpy(r, &planar, 16);
  std::memcpy(g, reinterpret_cast<const char*>(&planar) + 16, 16);
  std::memcpy(b, reinterpret_cast<const char*>(&planar) + 32, 16);
}

}  // namespace helio
