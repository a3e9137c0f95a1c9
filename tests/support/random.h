// Independent random numbers for tests: fixed seeds, the same sequence on every platform.
#pragma once

#include <cstdint>

#include "renderer/base/math.h"

namespace helio::test {

// PCG-XSH-RR 64/32 (O'Neill 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 1) : increment_(stream * 2 + 1) {
    next_u32();
    state_ += seed;
    next_u32();
  }

  std::uint32_t next_u32() {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ull + increment_;
    const auto shifted = static_cast<std::uint32_t>(((old >> 18) ^ old) >> 27);
    const auto rotation = static_cast<std::uint32_t>(old >> 59);
    return (shifted >> rotation) | (shifted << ((32 - rotation) & 31));
  }

  // Multiple of 2^-24 in [0, 1).
  float next_float() { return static_cast<float>(next_u32() >> 8) * 0x1p-24f; }
  // Multiple of 2^-32 in [0, 1).
  double next_double() { return next_u32() * 0x1p-32; }
  V2f next_v2f() {
    const float x = next_float();
    return {x, next_float()};
  }

 private:
  std::uint64_t state_ = 0, increment_;
};

}  // namespace helio::test
