#include "client/report/report_data.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "client/report/measure_names.h"
#include "client/report/number_text.h"

namespace helio::report {
namespace {

constexpr std::uint32_t kLeastSeeds = 5;  // compare.proto: below five there are no intervals

}  // namespace

ReportData::ReportData(const pb::CompareRecord& record) : record_(record), points_(modes()), units_(modes()) {
  for (std::size_t i = 0; i < modes(); ++i) mode_numbers_.emplace(mode_name(i), i);
  count_units();
  find_points();
}

std::size_t ReportData::budgets() const {
  return std::size_t(budgets_are_seconds() ? request().times_s_size() : request().samples_size());
}

std::string ReportData::budget_text(std::uint32_t budget) const {
  if (budget >= budgets()) return "budget " + std::to_string(budget);
  if (budgets_are_seconds()) return plain_number(request().times_s(int(budget))) + " s";
  return counted(request().samples(int(budget)), "sample");
}

const pb::ComparePoint* ReportData::point_of(std::size_t mode, std::uint32_t budget) const {
  for (const pb::ComparePoint* point : points_[mode]) {
    if (point->budget() == budget) return point;
  }
  return nullptr;
}

std::uint64_t ReportData::disturbed() const {
  std::uint64_t sum = 0;
  for (const UnitCount& count : units_) sum += count.disturbed;
  return sum;
}

bool ReportData::has_few_seeds(std::size_t mode) const {
  std::uint32_t most = 0;
  for (const pb::ComparePoint* point : points_[mode]) most = std::max(most, point->seeds());
  return most < kLeastSeeds;
}

bool ReportData::has_few_seeds(const std::string& mode) const {
  const auto found = mode_numbers_.find(mode);
  return found == mode_numbers_.end() || has_few_seeds(found->second);
}

void ReportData::count_units() {
  const std::uint32_t views = std::uint32_t(std::max(1, request().views_size()));
  std::set<std::tuple<std::size_t, std::uint32_t, std::uint32_t, std::uint32_t>> there;
  for (const pb::CompareUnit& unit : record_.units()) {
    const auto mode = mode_numbers_.find(unit.mode());
    if (mode == mode_numbers_.end()) continue;
    if (!there.emplace(mode->second, unit.seed_number(), unit.budget(), unit.view()).second) continue;
    UnitCount& count = units_[mode->second];
    ++count.there;
    count.disturbed += unit.disturbed();
    count.invalid_samples += unit.invalid_samples();
  }
  for (std::size_t mode = 0; mode < modes(); ++mode) {
    UnitCount& count = units_[mode];
    count.expected = std::uint64_t(request().seeds()) * budgets() * views;
    for (std::uint32_t seed = 1; seed <= request().seeds() && count.missing.size() < kMissingListed; ++seed) {
      for (std::uint32_t budget = 0; budget < budgets(); ++budget) {
        for (std::uint32_t view = 0; view < views && count.missing.size() < kMissingListed; ++view) {
          if (!there.contains({mode, seed, budget, view})) count.missing.push_back({seed, budget, view});
        }
      }
    }
  }
}

void ReportData::find_points() {
  for (const pb::ComparePoint& point : record_.table().points()) {
    const auto mode = mode_numbers_.find(point.mode());
    if (mode == mode_numbers_.end() || point.all_views() != is_path()) continue;
    points_[mode->second].push_back(&point);
    for (const pb::ComparePoint::Value& value : point.values()) {
      const MeasuredPart part{value.measure(), value.region()};
      if (std::find(parts_.begin(), parts_.end(), part) == parts_.end()) parts_.push_back(part);
    }
  }
  for (auto& points : points_) {
    std::stable_sort(points.begin(), points.end(),
                     [](const auto* a, const auto* b) { return a->budget() < b->budget(); });
  }
  std::stable_sort(parts_.begin(), parts_.end(), [](const MeasuredPart& a, const MeasuredPart& b) {
    return std::pair(reading_order(a.measure), !a.region.empty()) <
           std::pair(reading_order(b.measure), !b.region.empty());
  });
}

const pb::ComparePoint::Value* value_of(const pb::ComparePoint& point, const MeasuredPart& part) {
  for (const pb::ComparePoint::Value& value : point.values()) {
    if (value.measure() == part.measure && value.region() == part.region) return &value;
  }
  return nullptr;
}

}  // namespace helio::report
