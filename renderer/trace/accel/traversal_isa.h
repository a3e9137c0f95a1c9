// The instruction set that Embree builds and traverses with. Rendered bits are promised per build and per set.
#pragma once

#include <string>

#include "renderer/base/result.h"

namespace helio {

// For the whole process, before its first scene is built; until then a later choice replaces an earlier one.
// kAutomaticIsa keeps what was chosen, at first the newest set of the processor that Embree was compiled for.
// invalid_argument: no set of this processor (renderer/base/instruction_set.h). failed_precondition: another one is in
// use already.
Status choose_traversal_isa(const std::string& isa);

// The set in use: one of instruction_sets(), or "neon". From here on it is fixed. "none": Embree does not work here.
std::string traversal_isa();

// Of the library that is loaded, such as "4.3.3".
std::string embree_version();

}  // namespace helio
