// Integer hashes whose every output bit depends on every input bit. Neither is for keys that an enemy may choose.
#pragma once

#include <cstdint>

namespace helio {

// A member of C. Wellons' "triple32" family with low bias.
inline std::uint32_t hash32(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

// The finaliser of splitmix64 (Steele et al. 2014).
inline std::uint64_t hash64(std::uint64_t z) {
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return z ^ z >> 31;
}

}  // namespace helio
