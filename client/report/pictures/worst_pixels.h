// The pixels with the largest errors, and how to trace their samples again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/report/report_data.h"

namespace helio::report {

// A table of the worst pixels of each mode, of the first seed and the last budget, in that view; none: in the first
// view that has any. Empty: none are told.
std::string worst_pixels(const ReportData& data, std::optional<std::uint32_t> view);

}  // namespace helio::report
