// Variates of many paths at once: sampler.h in loops that vectorise.
#pragma once

#include <cstdint>

namespace helio {

// sample_pair() of each key, into x and y.
void sample_pairs(const std::uint32_t* keys, int count, std::uint32_t reversed_index, std::uint32_t pair, float* x,
                  float* y);

// sample_1d() of each key.
void sample_1ds(const std::uint32_t* keys, int count, std::uint32_t reversed_index, std::uint32_t dimension,
                float* values);

// square_to_cosine_hemisphere() of each (u, v), into x, y, z.
void cosine_hemispheres(const float* u, const float* v, int count, float* x, float* y, float* z);

}  // namespace helio
