// The pictures of the comparison, with the maps of their differences and their worst pixels.
#pragma once

#include <filesystem>
#include <string>

#include "client/report/report_data.h"

namespace helio::report {

// For each view that is shown: the reference, and of each mode the picture, its HDR-FLIP map and its signed difference
// map. The script adds a stage, on which two of them are flipped, split or shown beside each other at any exposure.
// Says so where there are no pictures, or where they are fewer or smaller than the comparison's.
std::string picture_section(const ReportData& data, const std::filesystem::path& folder);

}  // namespace helio::report
