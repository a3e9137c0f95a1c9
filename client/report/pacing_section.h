// How fast previews came: the time from a view to its preview.
#pragma once

#include <string>

#include "client/report/report_data.h"

namespace helio::report {

// Percentiles and a histogram of the seconds of each mode whose picture is a preview, over seeds and views from the
// second on, and its flicker. Empty: no mode has previews.
std::string pacing_section(const ReportData& data);

// The smallest value that at least that share of the values do not exceed, 0 < share <= 1. Precondition: not empty;
// sorted.
double percentile(const std::vector<double>& sorted, double share);

}  // namespace helio::report
