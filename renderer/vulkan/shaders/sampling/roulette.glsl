// Russian roulette: trace/sampling/roulette.h. A throughput that is not finite always goes on, so that the film counts
// the sample as invalid.
#ifndef ROULETTE_GLSL
#define ROULETTE_GLSL

#include "base/base.glsl"

const uint kRouletteRoot = 0;

float survival_probability(uint rule, vec3 throughput) {
  const float largest = max_component(throughput);
  return min(0.95, rule == kRouletteRoot ? sqrt(largest) : largest);
}

#endif
