// Owen-scrambled Sobol points keyed by (pixel, half, sample index, dimension, seed): trace/sampling/sampler.h, bit for
// bit.
#ifndef SAMPLER_GLSL
#define SAMPLER_GLSL

uint hash32(uint x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

uint reverse_bits(uint x) {
  return bitfieldReverse(x);
}

// Nested uniform scramble of a bit-reversed integer (Burley 2020, with Vegdahl's hash).
uint owen_hash(uint x, uint seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

uint combine_hash(uint a, uint b) {
  return hash32(a ^ (b + 0x9e3779b9u + (a << 6) + (a >> 2)));
}

// The scramble seed of one pixel in one half; `seed`: low and high word.
uint pixel_key(ivec2 pixel, uint sample_half, uvec2 seed) {
  uint key = combine_hash(seed.x, seed.y);
  key = combine_hash(key, uint(pixel.x));
  key = combine_hash(key, uint(pixel.y));
  return combine_hash(key, sample_half ^ 0x68bc21ebu);
}

// A number in [0, 1) of the upper 24 bits.
float unit_float(uint bits) {
  return float(bits >> 8) * (1.0 / 16777216.0);
}

uint sobol_dimension_1(uint reversed_index) {
  uint x = reversed_index;
  x ^= (x & 0x55555555u) << 1;
  x ^= (x & 0x33333333u) << 2;
  x ^= (x & 0x0f0f0f0fu) << 4;
  x ^= (x & 0x00ff00ffu) << 8;
  x ^= x << 16;
  return x;
}

// Both values of dimension pair `pair`; reversed_index: reverse_bits(sample index).
vec2 sample_pair(uint key, uint reversed_index, uint pair) {
  const uint seed = hash32(key ^ (pair * 0x9e3779b9u));
  const uint index = owen_hash(reversed_index, seed);
  const uint x = reverse_bits(owen_hash(reverse_bits(index), hash32(seed ^ 0x5bd1e995u)));
  const uint y = reverse_bits(owen_hash(reverse_bits(sobol_dimension_1(index)), hash32(seed ^ 0x1b873593u)));
  return vec2(unit_float(x), unit_float(y));
}

// One value of dimension `dimension`, numbered apart from the pairs.
float sample_1d(uint key, uint reversed_index, uint dimension) {
  const uint seed = hash32(key ^ (dimension * 0x85ebca6bu) ^ 0x27d4eb2fu);
  const uint index = owen_hash(reversed_index, seed);
  return unit_float(reverse_bits(owen_hash(reverse_bits(index), hash32(seed ^ 0x5bd1e995u))));
}

// Decides for each hit of a segment whether a blended surface lets the ray pass: PathKernelBase::alpha_key().
uint alpha_key(uint key, uint reversed_index, int segment) {
  return combine_hash(key ^ 0xa511e9b3u, reversed_index + uint(segment) * 0x9e3779b9u);
}

#endif
