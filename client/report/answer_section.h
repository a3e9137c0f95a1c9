// The top of the report: what was compared, the answer, and what may be wrong with it.
#pragma once

#include <string>

#include "client/report/report_data.h"

namespace helio::report {

// Title, the table's sentences, warnings (disturbed and missing units, calls that differ, invalid samples), the ratios
// at a glance and how the references were made.
std::string answer_section(const ReportData& data);

// "Sampling modes compared: NAME", not escaped.
std::string report_title(const ReportData& data);

}  // namespace helio::report
