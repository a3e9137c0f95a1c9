#include "renderer/trace/sampling/alias_table.h"

#include <numeric>

namespace helio {

AliasTable::AliasTable(std::span<const double> weights) : bins_(weights.size()) {
  const std::size_t count = weights.size();
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  std::vector<double> scaled(count);
  std::vector<std::uint32_t> small, large;
  for (std::size_t i = 0; i < count; ++i) {
    const double probability = total > 0 ? weights[i] / total : 1.0 / double(count);
    bins_[i].probability = float(probability);
    bins_[i].alias = std::uint32_t(i);
    scaled[i] = probability * double(count);
    (scaled[i] < 1 ? small : large).push_back(std::uint32_t(i));
  }
  while (!small.empty() && !large.empty()) {
    const std::uint32_t low = small.back(), high = large.back();
    small.pop_back();
    bins_[low].threshold = float(scaled[low]);
    bins_[low].alias = high;
    scaled[high] -= 1 - scaled[low];
    if (scaled[high] < 1) {
      large.pop_back();
      small.push_back(high);
    }
  }
  // What is left is 1 up to rounding: those bins keep threshold 1. A weight of 0 never keeps a bin.
  for (const std::uint32_t i : small) {
    if (bins_[i].probability == 0) {
      bins_[i].threshold = 0;
      bins_[i].alias = std::uint32_t(std::max_element(weights.begin(), weights.end()) - weights.begin());
    }
  }
}

}  // namespace helio
