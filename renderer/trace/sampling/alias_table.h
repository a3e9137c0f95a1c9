// Sampling a discrete distribution in constant time (Vose 1991, "A Linear Algorithm for Generating Random Numbers with
// a Given Distribution").
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "renderer/base/math.h"

namespace helio {

class AliasTable {
 public:
  AliasTable() = default;
  // Weights are finite and >= 0, at least one > 0; else the distribution is uniform.
  explicit AliasTable(std::span<const double> weights);

  struct Choice {
    std::uint32_t index = 0;
    float probability = 0;
    float u = 0;  // the variate's unused part, again uniform in [0, 1)
  };
  // u in [0, 1). Precondition: not empty.
  Choice sample(float u) const {
    const float scaled = u * float(bins_.size());
    const std::uint32_t index = std::min(std::uint32_t(scaled), std::uint32_t(bins_.size() - 1));
    const float rest = std::min(scaled - float(index), kOneMinusEpsilon);
    const Bin& bin = bins_[index];
    if (rest < bin.threshold) return {index, bin.probability, std::min(rest / bin.threshold, kOneMinusEpsilon)};
    const float u_alias = std::min((rest - bin.threshold) / (1 - bin.threshold), kOneMinusEpsilon);
    return {bin.alias, bins_[bin.alias].probability, u_alias};
  }
  float probability(std::uint32_t index) const { return bins_[index].probability; }

  std::size_t size() const { return bins_.size(); }
  std::size_t memory_bytes() const { return bins_.capacity() * sizeof(Bin); }

  struct Bin {
    float threshold = 1;  // below it the bin's own index, above it the alias
    std::uint32_t alias = 0;
    float probability = 0;
  };
  std::span<const Bin> bins() const { return bins_; }

 private:
  std::vector<Bin> bins_;
};

}  // namespace helio
