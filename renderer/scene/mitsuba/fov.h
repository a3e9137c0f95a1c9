// The field of view of what maps directions as a perspective camera does: properties fov, fov_axis and focal_length.
#pragma once

#include "renderer/scene/mitsuba/values.h"

namespace helio::mitsuba {

// The vertical angle, radians, (0, pi), of a picture `aspect` times as wide as high.
double vertical_fov(const Plugin& plugin, double aspect);

}  // namespace helio::mitsuba
