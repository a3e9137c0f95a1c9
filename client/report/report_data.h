// A record as the sections of a report read it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "heliograph/v1/compare.pb.h"

namespace helio::report {

namespace pb = heliograph::v1;

// A measure of the whole picture (region empty) or of a part of it.
struct MeasuredPart {
  pb::CompareMeasure measure = pb::COMPARE_MEASURE_UNSPECIFIED;
  std::string region;

  bool operator==(const MeasuredPart&) const = default;
};

// The units of one mode, and those that there should be.
struct UnitCount {
  std::uint64_t expected = 0, there = 0, disturbed = 0, invalid_samples = 0;
  // Seed numbers, budgets and views of the first kMissingListed units that are missing.
  struct Missing {
    std::uint32_t seed_number, budget, view;
  };
  std::vector<Missing> missing;
};
inline constexpr std::size_t kMissingListed = 12;

class ReportData {
 public:
  // The record must outlive this.
  explicit ReportData(const pb::CompareRecord& record);

  const pb::CompareRecord& record() const { return record_; }
  const pb::CompareRequest& request() const { return record_.request(); }
  std::size_t modes() const { return std::size_t(request().modes_size()); }
  const std::string& mode_name(std::size_t mode) const { return request().modes(int(mode)).name(); }
  // The baseline's name; empty: there are no modes.
  std::string baseline() const { return modes() == 0 ? std::string() : mode_name(0); }
  bool is_path() const { return request().views_size() > 1; }

  std::size_t budgets() const;
  bool budgets_are_seconds() const { return request().samples_size() == 0; }
  std::string budget_text(std::uint32_t budget) const;  // "64 samples", "0.5 s"

  // One for each budget of a mode, in order: of all views of a path, else of the only view. Those without a unit are
  // missing.
  const std::vector<const pb::ComparePoint*>& points_of(std::size_t mode) const { return points_[mode]; }
  const pb::ComparePoint* point_of(std::size_t mode, std::uint32_t budget) const;

  // That the table tells of, those that a reader asks for first at the front.
  const std::vector<MeasuredPart>& parts() const { return parts_; }
  const UnitCount& units_of(std::size_t mode) const { return units_[mode]; }
  std::uint64_t disturbed() const;

  // Why a mean of that mode, or its ratio to the baseline, has no interval: a sentence.
  bool has_few_seeds(std::size_t mode) const;
  bool has_few_seeds(const std::string& mode) const;

 private:
  void count_units();
  void find_points();

  const pb::CompareRecord& record_;
  std::map<std::string, std::size_t> mode_numbers_;
  std::vector<std::vector<const pb::ComparePoint*>> points_;  // by mode
  std::vector<MeasuredPart> parts_;
  std::vector<UnitCount> units_;  // by mode
};

// The value of a point; null: it has none of that.
const pb::ComparePoint::Value* value_of(const pb::ComparePoint& point, const MeasuredPart& part);

}  // namespace helio::report
