// A hall of many lamps: what selecting lights is measured on.
//
// 80 m long, 40 m wide, 6 m high; its ceiling is cut into bays by beams 0.6 m deep every 4 m, on pillars every 8 m, and
// crates stand between these. Square lamps face down from 10 cm below the ceiling, one in each cell of a grid, at a
// random place of it. Their powers are spread from 1 to 1000, evenly in the logarithm. However many they are, their
// powers and (from 16 on) their areas add up to the same: of 10,000 each has a side of 8 cm. The camera stands
// in the hall and looks along it: about a tenth of the ceiling is in its view. One lamp alone is behind it. All
// surfaces are diffuse. Everything is a function of the number of lamps.
#pragma once

#include "renderer/scene/description/scene_description.h"

namespace helio::bench {

inline constexpr float kHallWidth = 40, kHallHeight = 6, kHallLength = 80;  // x, y, z from the origin; metres

// `lamps` is rounded down to a square number. Precondition: 1 to 2^20 lamps.
SceneDescription lamp_hall(int lamps);

}  // namespace helio::bench
