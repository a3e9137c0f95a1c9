// What this binary is.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace helio {

const char* build_version();
const char* build_description();  // compiler and build type
const char* build_isa();          // what the kernels were compiled for
// Names and versions of the libraries that it was compiled against.
std::vector<std::pair<std::string, std::string>> build_libraries();

}  // namespace helio
