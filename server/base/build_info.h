// What this binary is.
#pragma once

namespace helio {

const char* build_version();
const char* build_description();  // compiler and build type
const char* build_isa();          // what the kernels were compiled for
const char* build_embree();

}  // namespace helio
