// Owen-scrambled Sobol points keyed by (pixel, half, sample index, dimension, seed).
//
// Each pair of dimensions is an independent, randomly scrambled and shuffled copy of the (0, 2)-sequence in base 2
// ("padding"): B. Burley, Practical Hash-based Owen Scrambling, JCGT 9(4), 2020. Scrambling is by N. Vegdahl's improved
// Laine-Karras hash; the second Sobol matrix (Pascal's triangle mod 2) is applied as five butterflies. Every value is a
// function of the key alone, so any order of evaluation gives the same bits. Functions are branch-free on 32-bit
// integers: loops over paths vectorise.
#pragma once

#include <cstdint>

#include "renderer/base/hash.h"
#include "renderer/base/math.h"

namespace helio {

inline std::uint32_t reverse_bits(std::uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
  return (x >> 16) | (x << 16);
}

// Nested uniform scramble of a bit-reversed integer: bit i of the result depends on bits 0..i of x and on the seed.
inline std::uint32_t owen_hash(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

inline std::uint32_t combine_hash(std::uint32_t a, std::uint32_t b) {
  return hash32(a ^ (b + 0x9e3779b9u + (a << 6) + (a >> 2)));
}

// The scramble seed of one pixel in one half.
inline std::uint32_t pixel_key(int x, int y, int half, std::uint64_t seed) {
  std::uint32_t key = combine_hash(std::uint32_t(seed), std::uint32_t(seed >> 32));
  key = combine_hash(key, std::uint32_t(x));
  key = combine_hash(key, std::uint32_t(y));
  return combine_hash(key, std::uint32_t(half) ^ 0x68bc21ebu);
}

// [0, 1) with 24 bits.
inline float unit_float(std::uint32_t bits) {
  return float(bits >> 8) * 0x1p-24f;
}

// The second Sobol matrix (entry (j, i) is C(i, j) mod 2: j a bit-subset of i) applied to a bit-reversed index; the
// result is the 32-bit fraction.
inline std::uint32_t sobol_dimension_1(std::uint32_t reversed_index) {
  std::uint32_t x = reversed_index;
  x ^= (x & 0x55555555u) << 1;
  x ^= (x & 0x33333333u) << 2;
  x ^= (x & 0x0f0f0f0fu) << 4;
  x ^= (x & 0x00ff00ffu) << 8;
  x ^= x << 16;
  return x;
}

struct SamplePair {
  float x, y;
};

// Both values of dimension pair `pair` at a sample. `reversed_index` is reverse_bits(sample index).
inline SamplePair sample_pair(std::uint32_t key, std::uint32_t reversed_index, std::uint32_t pair) {
  const std::uint32_t seed = hash32(key ^ (pair * 0x9e3779b9u));
  const std::uint32_t index = owen_hash(reversed_index, seed);  // bit-reversed shuffled index
  // The fraction of dimension 0 is the bit-reversed index itself. Owen scrambling works from the top bit down.
  const std::uint32_t x = reverse_bits(owen_hash(reverse_bits(index), hash32(seed ^ 0x5bd1e995u)));
  const std::uint32_t y = reverse_bits(owen_hash(reverse_bits(sobol_dimension_1(index)), hash32(seed ^ 0x1b873593u)));
  return {unit_float(x), unit_float(y)};
}

// One value of dimension `dimension` (numbered apart from the pairs).
inline float sample_1d(std::uint32_t key, std::uint32_t reversed_index, std::uint32_t dimension) {
  const std::uint32_t seed = hash32(key ^ (dimension * 0x85ebca6bu) ^ 0x27d4eb2fu);
  const std::uint32_t index = owen_hash(reversed_index, seed);
  return unit_float(reverse_bits(owen_hash(reverse_bits(index), hash32(seed ^ 0x5bd1e995u))));
}

}  // namespace helio
