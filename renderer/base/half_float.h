// Half floats for storage, of numbers that have no sign.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

namespace helio {

// Largest half.
inline constexpr float kMostHalf = 65504;

// Rounded to nearest. What is negative or no number becomes 0, what is beyond kMostHalf that.
inline std::uint16_t pack_half(float x) {
  const float scaled = std::min(std::max(0.0f, x), kMostHalf) * 0x1p-112f;
  return std::uint16_t((std::bit_cast<std::uint32_t>(scaled) + 0x1000u) >> 13);
}
inline float unpack_half(std::uint16_t half) {
  return std::bit_cast<float>(std::uint32_t(half) << 13) * 0x1p112f;
}

}  // namespace helio
