#include "renderer/comparison/comparison_table.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>
#include <utility>

#include "renderer/comparison/few_pixels.h"
#include "renderer/comparison/ratios.h"
#include "renderer/comparison/seed_values.h"
#include "renderer/comparison/sentences.h"

namespace helio {
namespace {

ComparedPoint make_point(const std::string& mode, std::uint32_t budget, std::optional<std::uint32_t> view,
                         const std::vector<SeedValues>& seeds, const SeedTable& table, PathViews views) {
  const std::vector<ValueKey>& keys = table.keys();
  ComparedPoint point;
  point.mode = mode;
  point.budget = budget;
  point.view = view;
  point.seeds = std::uint32_t(seeds.size());
  std::vector<double> seconds;
  std::vector<const SeedValues*> all;
  for (const SeedValues& seed : seeds) {
    all.push_back(&seed);
    seconds.push_back(seed.seconds);
    point.samples += seed.samples / double(seeds.size());
    point.disturbed += seed.disturbed;
  }
  point.seconds = cut(mean_interval(seconds), 0, std::numeric_limits<double>::infinity());
  for (std::size_t key = 0; key < keys.size(); ++key) {
    std::vector<double> values;
    for (const SeedValues& seed : seeds) {
      if (seed.values[key]) values.push_back(*seed.values[key]);
    }
    if (values.empty()) continue;
    const ValueRange range = possible_values(keys[key].measure);
    const double reference_error = view ? table.reference_error(key, *view) : table.reference_error(key, views);
    point.values.push_back({keys[key].measure, keys[key].region,
                            widened(cut(mean_interval(values), range.low, range.high), reference_error),
                            few_pixels_decide(all, keys, key)});
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
        if (!values.empty())
          table.points.push_back(make_point(script.modes[mode], budget, view, values, seeds, seeds.views_of(mode)));
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
