#include "renderer/trace/sampling/sample_batch.h"

#include "renderer/trace/sampling/sampler.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {

void sample_pairs(const std::uint32_t* keys, int count, std::uint32_t reversed_index, std::uint32_t pair,
                  float* __restrict x, float* __restrict y) {
  for (int i = 0; i < count; ++i) {
    const SamplePair drawn = sample_pair(keys[i], reversed_index, pair);
    x[i] = drawn.x;
    y[i] = drawn.y;
  }
}

void sample_1ds(const std::uint32_t* keys, int count, std::uint32_t reversed_index, std::uint32_t dimension,
                float* __restrict values) {
  for (int i = 0; i < count; ++i) values[i] = sample_1d(keys[i], reversed_index, dimension);
}

void cosine_hemispheres(const float* u, const float* v, int count, float* __restrict x, float* __restrict y,
                        float* __restrict z) {
  for (int i = 0; i < count; ++i) {
    const V3f direction = square_to_cosine_hemisphere({u[i], v[i]});
    x[i] = direction.x;
    y[i] = direction.y;
    z[i] = direction.z;
  }
}

}  // namespace helio
