// Numbers as the report prints them.
#pragma once

#include <string>

#include "heliograph/v1/compare.pb.h"

namespace helio::report {

// Three significant digits: "0.00123", "1.50", "123", "45600", "1.23e-6" below 1e-3 and from 1e6 on; "0". "unknown" for
// what is not finite.
std::string number(double value);

// As somebody wrote it: "64", "0.5", "65536"; six digits at most.
std::string plain_number(double value);

// "[1.20, 1.50]"; empty where the interval is not known.
std::string interval_text(const heliograph::v1::CompareInterval& interval);

// "12 units", "1 unit".
std::string counted(std::uint64_t count, const std::string& noun);

}  // namespace helio::report
