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

// One channel of four pixels each.
inline void store_planar(const Float16& pixels, float* r, float* g, float* b) {
  const Float16 planar = __builtin_shufflevector(pixels, pixels, 0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
  std::memcpy(r, &planar, 16);
  std::memcpy(g, reinterpret_cast<const char*>(&planar) + 16, 16);
  std::memcpy(b, reinterpret_cast<const char*>(&planar) + 32, 16);
}

}  // namespace helio
