// Modes against the first one: ratios with their intervals and verdicts.
#pragma once

#include <string>

#include "client/report/report_data.h"

namespace helio::report {

// "Equal error", with the sentence that says how its ratios are read.
struct RatioKindName {
  std::string title, reading;
  std::string unit;              // of CompareRatio.at
  bool above_is_better = false;  // the ratio is better above 1
};
RatioKindName name_of(pb::CompareRatio::Kind kind);

// A table with one row for each value of `at` and one column for each mode but the first; empty: there is no such
// ratio. Of KIND_SPEED the part is not asked for.
std::string ratio_table(const ReportData& data, pb::CompareRatio::Kind kind, const MeasuredPart& part);

// The row of a mode and kind at the hardest point (the smallest error, the longest time, the most samples), for each
// mode but the first: ratio, interval as a bar around 1, and verdict. Empty: there are no ratios.
std::string glance_table(const ReportData& data);

}  // namespace helio::report
