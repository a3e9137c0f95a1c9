// Sampling a discrete distribution in constant time: trace/sampling/alias_table.h.
#ifndef ALIAS_TABLE_GLSL
#define ALIAS_TABLE_GLSL

#include "base/base.glsl"
#include "tables/lights.h"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer AliasBins {
  AliasBinTable at[];
};

struct AliasChoice {
  uint index;
  float probability;
};

// Draws an index; u in [0, 1). Precondition: count > 0.
AliasChoice sample_alias(uint64_t table, uint count, float u) {
  AliasBins bins = AliasBins(table);
  const float scaled = u * float(count);
  const uint index = min(uint(scaled), count - 1);
  const float rest = min(scaled - float(index), kOneMinusEpsilon);
  const AliasBinTable bin = bins.at[index];
  if (rest < bin.threshold) return AliasChoice(index, bin.probability);
  return AliasChoice(bin.alias, bins.at[bin.alias].probability);
}

float alias_probability(uint64_t table, uint index) {
  return AliasBins(table).at[index].probability;
}

#endif
