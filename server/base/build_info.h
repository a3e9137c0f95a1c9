// What this binary is.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace helio {

const char* build_version();
const char* build_isa();  // what the kernels were compiled for
// The same, and the set that Embree traverses with, which is fixed from here on (traversal_isa.h): what rendered bits
// depend on beside the build. "avx2, traversal by avx512".
std::string rendering_isa();
// The first 10 hexadecimal digits of the build id that the linker gave this program (-Wl,--build-id), which another
// source, compiler or option changes. Empty: it has none.
const std::string& build_id();
// Compiler, build type and build id: "g++ 12.2.0, Release, 0123456789".
const std::string& build_description();
// Names and versions of the libraries that it was compiled against.
std::vector<std::pair<std::string, std::string>> build_libraries();

}  // namespace helio
