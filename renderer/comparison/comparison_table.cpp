#include "renderer/comparison/comparison_table.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

#include "renderer/comparison/heavy_tails.h"
#include "renderer/comparison/ratios.h"
#include "renderer/comparison/seed_values.h"
#include "renderer/comparison/sentences.h"

namespace helio {
namespace {

bool is_squared_error(Measure measure) {
  return measure == Measure::mse || measure == Measure::relmse || measure == Measure::distance_variance;
}

// The outlier shares of the seeds that have the error; empty where one of them has no share.
std::vector<double> outlier_shares(const std::vector<SeedValues>& seeds, const std::vector<ValueKey>& keys,
                                   std::size_t key) {
  if (!is_squared_error(keys[key].measure)) return {};
  const auto share = std::find(keys.begin(), keys.end(), ValueKey{Measure::outlier_share, keys[key].region});
  if (share == keys.end()) return {};
  std::vector<double> shares;
  for (const SeedValues& seed : seeds) {
    if (!seed.values[key]) continue;
    const std::optional<double>& value = seed.values[std::size_t(share - keys.begin())];
    if (!value) return {};
    shares.push_back(*value);
  }
  return shares;
}

ComparedPoint make_point(const std::string& mode, std::uint32_t budget, std::optional<std::uint32_t> view,
                         const std::vector<SeedValues>& seeds, const std::vector<ValueKey>& keys) {
  ComparedPoint point;
  point.mode = mode;
  point.budget = budget;
  point.view = view;
  point.seeds = std::uint32_t(seeds.size());
  std::vector<double> seconds;
  for (const SeedValues& seed : seeds) {
    seconds.push_back(seed.seconds);
    point.samples += seed.samples / double(seeds.size());
    point.disturbed += seed.disturbed;
  }
  point.seconds = mean_interval(seconds);
  for (std::size_t key = 0; key < keys.size(); ++key) {
    std::vector<double> values;
    for (const SeedValues& seed : seeds) {
      if (seed.values[key]) values.push_back(*seed.values[key]);
    }
    if (values.empty()) continue;
    // Shares of the error say how it is spread; that rare pixels have much of it is no finding about the share itself.
    const bool may_be_decided = keys[key].measure != Measure::outlier_share;
    point.values.push_back({keys[key].measure, keys[key].region, mean_interval(values),
                            may_be_decided && few_pixels_decide(values, outlier_shares(seeds, keys, key))});
  }
  return point;
}

}  // namespace

ComparisonTable compare_units(const ComparisonScript& script, const std::vector<ComparedUnit>& units) {
  const SeedTable seeds(script, units);
  ComparisonTable table;
  for (std::size_t mode = 0; mode < script.modes.size(); ++mode) {
    for (std::uint32_t budget = 0; budget < script.budgets.size(); ++budget) {
      const auto add = [&](std::optional<std::uint32_t> view, const std::vector<SeedValues>& values) {
        if (!values.empty()) table.points.push_back(make_point(script.modes[mode], budget, view, values, seeds.keys()));
      };
      for (std::uint32_t view = 0; view < script.views; ++view) add(view, seeds.at(mode, budget, view));
      if (script.views > 1) add(std::nullopt, seeds.over_views(mode, budget));
    }
  }
  for (std::size_t mode = 1; mode < script.modes.size(); ++mode) {
    std::vector<ComparedRatio> ratios = compare_modes(script, seeds, mode, 0);
    std::move(ratios.begin(), ratios.end(), std::back_inserter(table.ratios));
  }
  table.sentences = comparison_sentences(script, seeds, table);
  return table;
}

}  // namespace helio
