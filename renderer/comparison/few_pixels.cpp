#include "renderer/comparison/few_pixels.h"

#include <algorithm>

#include "renderer/comparison/heavy_tails.h"

namespace helio {
namespace {

bool is_squared_error(Measure measure) {
  return measure == Measure::mse || measure == Measure::relmse || measure == Measure::distance_variance;
}

// Of the seeds that have the error; empty where one of them has no share.
std::vector<double> outlier_shares(std::span<const SeedValues* const> seeds, const std::vector<ValueKey>& keys,
                                   std::size_t key) {
  if (!is_squared_error(keys[key].measure)) return {};
  const auto share = std::find(keys.begin(), keys.end(), ValueKey{Measure::outlier_share, keys[key].region});
  if (share == keys.end()) return {};
  std::vector<double> shares;
  for (const SeedValues* seed : seeds) {
    if (!seed->values[key]) continue;
    const std::optional<double>& value = seed->values[std::size_t(share - keys.begin())];
    if (!value) return {};
    shares.push_back(*value);
  }
  return shares;
}

}  // namespace

bool few_pixels_decide(std::span<const SeedValues* const> seeds, const std::vector<ValueKey>& keys, std::size_t key) {
  if (keys[key].measure == Measure::outlier_share) return false;
  std::vector<double> values;
  for (const SeedValues* seed : seeds) {
    if (seed->values[key]) values.push_back(*seed->values[key]);
  }
  return few_pixels_decide(values, outlier_shares(seeds, keys, key));
}

}  // namespace helio
