// The complete settings of modes, views, regions and references, field by field.
#pragma once

#include <string>

#include "client/report/report_data.h"

namespace helio::report {

// Rows are fields by their path in the protocol, columns are modes; rows in which modes differ are marked. Then the
// views, the regions and the settings of a rendered reference. Fields that are not set are 0 and stand as "–".
std::string settings_table(const ReportData& data);

}  // namespace helio::report
