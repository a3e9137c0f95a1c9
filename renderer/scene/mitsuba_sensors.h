// Sensors perspective, thinlens and orthographic, with the size of their film.
#pragma once

#include "renderer/scene/mitsuba_context.h"

namespace helio::mitsuba {

void read_sensor(const Element& element, LoadContext& context);

}  // namespace helio::mitsuba
