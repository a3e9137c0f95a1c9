// Units sorted into points: what each seed of a mode came to at a budget and a view, or on average over all views.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "renderer/comparison/comparison_table.h"

namespace helio {

struct ValueKey {
  Measure measure = Measure::mse;
  std::string region;

  auto operator<=>(const ValueKey&) const = default;
};

struct SeedValues {
  std::uint32_t seed_number = 1;
  double seconds = 0, samples = 0;
  std::vector<std::optional<double>> values;  // by the index of their key; none: not defined for this picture
  std::uint32_t disturbed = 0;                // units
  std::uint32_t call = 0;                     // ComparedUnit::call; of several views that of the first
};

// Which views of a path a mean is over. Of a still both are its view.
enum class PathViews { all, but_the_first };

class SeedTable {
 public:
  SeedTable(const ComparisonScript& script, const std::vector<ComparedUnit>& units);

  // All that some unit has, by measure; of each, the whole picture, the dark half, then the other regions by name.
  const std::vector<ValueKey>& keys() const { return keys_; }

  // By rising seed number; of several units of one mode, seed, budget and view the first. Indices of the script.
  const std::vector<SeedValues>& at(std::size_t mode, std::uint32_t budget, std::uint32_t view) const;

  // A preview mode of a path, whose first view is no preview (ComparisonScript::preview_modes).
  bool is_preview(std::size_t mode) const { return previews_[mode]; }
  // Those that a comparison of the modes is over: with a preview mode among them, all but the first.
  PathViews views_of(std::size_t mode) const { return is_preview(mode) ? PathViews::but_the_first : PathViews::all; }
  PathViews views_of(std::size_t mode, std::size_t other) const {
    return is_preview(mode) ? views_of(mode) : views_of(other);
  }

  // Means over these views, of the seeds that have all of them. A value is a mean over those views in which some unit
  // has it, and is there only for seeds that have it in all of these. Of a still the same as its view.
  const std::vector<SeedValues>& over_views(std::size_t mode, std::uint32_t budget, PathViews views) const;
  const std::vector<SeedValues>& over_views(std::size_t mode, std::uint32_t budget) const {
    return over_views(mode, budget, views_of(mode));
  }

  // Standard error of keys()[key] by the noise of the view's reference, or of the references of these views together
  // (MeasuredValue::reference_error); 0: not known.
  double reference_error(std::size_t key, std::uint32_t view) const { return reference_errors_[view][key]; }
  double reference_error(std::size_t key, PathViews views) const;

  // True if some unit of that view has the value, or the view has no unit that could say otherwise.
  bool is_defined(std::size_t key, std::uint32_t view) const;

 private:
  std::vector<SeedValues> mean_over_views(std::size_t mode, std::uint32_t budget, PathViews views) const;

  std::uint32_t views_;
  std::vector<ValueKey> keys_;
  std::vector<bool> previews_;                         // by mode
  std::vector<bool> has_units_;                        // by view
  std::vector<std::vector<bool>> has_key_;             // by view and key: whether some unit has it
  std::vector<std::vector<double>> reference_errors_;  // by view and key
  std::map<std::tuple<std::size_t, std::uint32_t, std::uint32_t>, std::vector<SeedValues>> points_;
  std::map<std::tuple<std::size_t, std::uint32_t, PathViews>, std::vector<SeedValues>> means_;
};

}  // namespace helio
