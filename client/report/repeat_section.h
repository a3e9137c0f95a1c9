// All that is needed to repeat a comparison.
#pragma once

#include <string>

#include "client/report/report_data.h"

namespace helio::report {

// Calls with their commands, daemons and machines; scene, seeds, views and references; units that there are and that
// are missing; notices.
std::string repeat_section(const ReportData& data);

}  // namespace helio::report
