// Points and ratios of a complete comparison, as its sentences look them up.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "renderer/comparison/comparison_table.h"
#include "renderer/comparison/seed_values.h"

namespace helio {

struct Findings {
  const ComparisonScript& script;
  const SeedTable& seeds;
  const ComparisonTable& table;

  const std::string& baseline() const { return script.modes[0]; }
  std::uint32_t budgets() const { return std::uint32_t(script.budgets.size()); }

  // The point of a mode, of a path that over all views; null where the mode has no seeds at that budget.
  const ComparedPoint* point(std::size_t mode, std::uint32_t budget) const;
  static const ComparedPoint::Value* value(const ComparedPoint* point, const ValueKey& key);
  bool has_points(std::size_t mode) const;

  // The last budget at which some mode has seeds.
  std::optional<std::uint32_t> last_budget() const;

  // The measure that most is told of: relmse, else mse, else the first error of the whole picture.
  std::optional<ValueKey> main_key() const;

  // The mode's ratio to the baseline at the latest budget, time or error; null where there is none.
  const ComparedRatio* latest_ratio(RatioKind kind, std::size_t mode, const ValueKey& key) const;

  // "after 64 samples per pixel", "in 2 s".
  std::string when(double at) const;
};

// The last of `ratios`, which are of one mode: of equal_error that at the lowest error, else that at the largest budget
// or time.
const ComparedRatio* latest_ratio(const std::vector<ComparedRatio>& ratios, RatioKind kind, const std::string& mode,
                                  const ValueKey& key);

}  // namespace helio
