#include "renderer/comparison/findings.h"

#include <algorithm>

#include "renderer/comparison/wording.h"

namespace helio {

const ComparedPoint* Findings::point(std::size_t mode, std::uint32_t budget) const {
  const std::optional<std::uint32_t> view = script.views > 1 ? std::nullopt : std::optional(0u);
  for (const ComparedPoint& point : table.points) {
    if (point.mode == script.modes[mode] && point.budget == budget && point.view == view) return &point;
  }
  return nullptr;
}

const ComparedPoint::Value* Findings::value(const ComparedPoint* point, const ValueKey& key) {
  if (!point) return nullptr;
  for (const ComparedPoint::Value& value : point->values) {
    if (value.measure == key.measure && value.region == key.region) return &value;
  }
  return nullptr;
}

bool Findings::has_points(std::size_t mode) const {
  return std::any_of(table.points.begin(), table.points.end(),
                     [&](const ComparedPoint& point) { return point.mode == script.modes[mode]; });
}

std::optional<std::uint32_t> Findings::last_budget() const {
  std::optional<std::uint32_t> last;
  for (const ComparedPoint& point : table.points) last = std::max(last.value_or(0), point.budget);
  return last;
}

std::optional<ValueKey> Findings::main_key() const {
  for (const Measure measure : {Measure::relmse, Measure::mse}) {
    const ValueKey key{measure, {}};
    if (std::find(seeds.keys().begin(), seeds.keys().end(), key) != seeds.keys().end()) return key;
  }
  for (const ValueKey& key : seeds.keys()) {
    if (is_error(key.measure) && key.region.empty()) return key;
  }
  return std::nullopt;
}

const ComparedRatio* Findings::latest_ratio(RatioKind kind, std::size_t mode, const ValueKey& key) const {
  return helio::latest_ratio(table.ratios, kind, script.modes[mode], key);
}

std::string Findings::when(double at) const {
  return (script.budgets_are_seconds ? "in " : "after ") + budget_text(script, at);
}

const ComparedRatio* latest_ratio(const std::vector<ComparedRatio>& ratios, RatioKind kind, const std::string& mode,
                                  const ValueKey& key) {
  const ComparedRatio* found = nullptr;
  for (const ComparedRatio& ratio : ratios) {
    if (ratio.kind != kind || ratio.mode != mode) continue;
    if (kind != RatioKind::speed && ValueKey{ratio.measure, ratio.region} != key) continue;
    if (!found || (kind == RatioKind::equal_error ? ratio.at < found->at : ratio.at > found->at)) found = &ratio;
  }
  return found;
}

}  // namespace helio
