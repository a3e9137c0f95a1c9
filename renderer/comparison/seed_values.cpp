#include "renderer/comparison/seed_values.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace helio {
namespace {

const std::vector<SeedValues> kNone;

std::optional<std::size_t> index_of(const std::vector<std::string>& modes, const std::string& name) {
  const auto found = std::find(modes.begin(), modes.end(), name);
  if (found == modes.end()) return std::nullopt;
  return std::size_t(found - modes.begin());
}

bool comes_before(const ValueKey& a, const ValueKey& b) {
  const auto rank = [](const ValueKey& key) {
    return std::tuple(key.measure, key.region.empty() ? 0 : key.region == kDarkHalf ? 1 : 2);
  };
  return std::pair(rank(a), a.region) < std::pair(rank(b), b.region);
}

}  // namespace

SeedTable::SeedTable(const ComparisonScript& script, const std::vector<ComparedUnit>& units)
    : views_(std::max(script.views, 1u)) {
  const auto known = [&](const ComparedUnit& unit) {
    return unit.budget < script.budgets.size() && unit.view < views_ && index_of(script.modes, unit.mode).has_value();
  };
  for (const std::string& mode : script.modes) {
    const auto& previews = script.preview_modes;
    previews_.push_back(views_ > 1 && std::find(previews.begin(), previews.end(), mode) != previews.end());
  }
  std::set<ValueKey, decltype(&comes_before)> keys(&comes_before);
  for (const ComparedUnit& unit : units) {
    if (!known(unit)) continue;
    for (const MeasuredValue& value : unit.values) keys.insert({value.measure, value.region});
  }
  keys_.assign(keys.begin(), keys.end());
  has_units_.assign(views_, false);
  has_key_.assign(views_, std::vector<bool>(keys_.size(), false));
  reference_errors_.assign(views_, std::vector<double>(keys_.size(), 0.0));

  for (const ComparedUnit& unit : units) {
    if (!known(unit)) continue;
    std::vector<SeedValues>& point = points_[{*index_of(script.modes, unit.mode), unit.budget, unit.view}];
    SeedValues seed{unit.seed_number, unit.seconds, unit.samples, {}, unit.disturbed ? 1u : 0u, unit.call};
    seed.values.resize(keys_.size());
    has_units_[unit.view] = true;
    for (const MeasuredValue& value : unit.values) {
      const auto key =
          std::lower_bound(keys_.begin(), keys_.end(), ValueKey{value.measure, value.region}, comes_before);
      const std::size_t index = std::size_t(key - keys_.begin());
      if (!seed.values[index]) seed.values[index] = value.value;
      has_key_[unit.view][index] = true;
      double& error = reference_errors_[unit.view][index];
      error = std::max(error, value.reference_error);
    }
    point.push_back(std::move(seed));
  }
  for (auto& [place, seeds] : points_) {
    std::stable_sort(seeds.begin(), seeds.end(),
                     [](const SeedValues& a, const SeedValues& b) { return a.seed_number < b.seed_number; });
    const auto same = [](const SeedValues& a, const SeedValues& b) { return a.seed_number == b.seed_number; };
    seeds.erase(std::unique(seeds.begin(), seeds.end(), same), seeds.end());
  }
  if (views_ == 1) return;
  for (std::size_t mode = 0; mode < script.modes.size(); ++mode) {
    for (std::uint32_t budget = 0; budget < script.budgets.size(); ++budget) {
      for (const PathViews views : {PathViews::all, PathViews::but_the_first})
        means_[{mode, budget, views}] = mean_over_views(mode, budget, views);
    }
  }
}

const std::vector<SeedValues>& SeedTable::at(std::size_t mode, std::uint32_t budget, std::uint32_t view) const {
  const auto found = points_.find({mode, budget, view});
  return found == points_.end() ? kNone : found->second;
}

const std::vector<SeedValues>& SeedTable::over_views(std::size_t mode, std::uint32_t budget, PathViews views) const {
  if (views_ == 1) return at(mode, budget, 0);
  const auto found = means_.find({mode, budget, views});
  return found == means_.end() ? kNone : found->second;
}

double SeedTable::reference_error(std::size_t key, PathViews views) const {
  double squares = 0, count = 0;
  for (std::uint32_t view = views == PathViews::all || views_ == 1 ? 0 : 1; view < views_; ++view) {
    if (!has_key_[view][key]) continue;
    squares += reference_errors_[view][key] * reference_errors_[view][key];
    ++count;
  }
  return count > 0 ? std::sqrt(squares) / count : 0;
}

bool SeedTable::is_defined(std::size_t key, std::uint32_t view) const {
  return has_key_[view][key] || !has_units_[view];
}

std::vector<SeedValues> SeedTable::mean_over_views(std::size_t mode, std::uint32_t budget, PathViews views) const {
  struct Sum {
    SeedValues means;
    std::uint32_t views = 0;
  };
  const std::uint32_t first = views == PathViews::all ? 0 : 1, count = views_ - first;
  std::map<std::uint32_t, Sum> sums;
  std::vector<double> views_with(keys_.size(), 0);
  for (std::uint32_t view = first; view < views_; ++view) {
    for (std::size_t key = 0; key < keys_.size(); ++key) views_with[key] += has_key_[view][key] ? 1 : 0;
  }
  for (std::uint32_t view = first; view < views_; ++view) {
    for (const SeedValues& seed : at(mode, budget, view)) {
      Sum& sum = sums[seed.seed_number];
      if (sum.views++ == 0) {
        sum.means.seed_number = seed.seed_number;
        sum.means.call = seed.call;
        sum.means.values.assign(keys_.size(), 0.0);
      }
      sum.means.seconds += seed.seconds / count;
      sum.means.samples += seed.samples / count;
      sum.means.disturbed += seed.disturbed;
      for (std::size_t key = 0; key < keys_.size(); ++key) {
        if (!has_key_[view][key]) continue;
        std::optional<double>& mean = sum.means.values[key];
        if (mean && seed.values[key]) {
          *mean += *seed.values[key] / views_with[key];
        } else {
          mean.reset();
        }
      }
    }
  }
  std::vector<SeedValues> complete;
  for (auto& [number, sum] : sums) {
    if (sum.views == count) complete.push_back(std::move(sum.means));
  }
  return complete;
}

}  // namespace helio
