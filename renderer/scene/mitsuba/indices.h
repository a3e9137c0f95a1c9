// Named materials: indices of refraction, and complex indices of metals.
#pragma once

#include "renderer/scene/mitsuba/values.h"

namespace helio::mitsuba {

// int_ior or ext_ior: a number in (0, 100], or a name ("bk7"). At 20 degrees and the sodium line where it matters.
double read_ior(const Plugin& plugin, const char* name, double fallback);

struct ComplexIndex {
  Rgb eta, k;
};

// The metal of that name: the values usual for the three sRGB primaries (about 610, 549 and 465 nm). "none" mirrors
// everything. Unknown names are reported with the list of known ones.
ComplexIndex metal_index(const Plugin& plugin, const std::string& name);

}  // namespace helio::mitsuba
