// The files that a report is written to.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "renderer/base/result.h"

namespace helio::bench {

// Writes each (name, text) into `folder`, which is made; empty: nothing is written. permission_denied: the folder
// cannot be made; and what write_file_atomically says.
Status write_reports(const std::string& folder, const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace helio::bench
