// The CIE's standard observer of 1931 (2 degrees) and its illuminant D65, every 5 nm from 360 to 830 nm (CIE 15, tables
// T.1 and T.4), linear in between.
#pragma once

#include "renderer/base/math.h"

namespace helio {

inline constexpr double kCieFirst = 360, kCieLast = 830;  // nm

// The colour matching functions x, y, z at `nm` in [kCieFirst, kCieLast].
V3d cie_1931_observer(double nm);

// Relative power, 100 at 560 nm.
double cie_d65(double nm);

}  // namespace helio
