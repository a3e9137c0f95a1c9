// The curves of the measures, with the tables that belong to them.
#pragma once

#include <string>

#include "client/report/report_data.h"

namespace helio::report {

// Legend and selection, then for each measure and region: error against time and against samples, the value of every
// point with its interval, and the ratios at equal error, time and samples. Without script all are shown, one after the
// other. Says so when the record has no table.
std::string measure_section(const ReportData& data);

// Time for as many samples, and the seconds of every point.
std::string speed_section(const ReportData& data);

}  // namespace helio::report
