// Integer hashes. None is for keys that an enemy may choose. Every output bit of hash32 and hash64 depends on every
// input bit.
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

// FNV-1a with 64 bits (Fowler, Noll and Vo), one step: hash = fnv1a(hash, byte) for each byte, from kFnv1aStart on.
// Wider values are taken as they are.
inline constexpr std::uint64_t kFnv1aStart = 0xcbf29ce484222325u;
constexpr std::uint64_t fnv1a(std::uint64_t hash, std::uint64_t value) {
  return (hash ^ value) * 0x100000001b3u;
}

}  // namespace helio
