// Sensors perspective, thinlens and orthographic, with the size of their film.
#pragma once

#include "renderer/scene/mitsuba/context.h"

namespace helio::mitsuba {

void read_sensor(const Element& element, LoadContext& context);

// Once all shapes are read: a notice for every near_clip and far_clip that may hide some of them in Mitsuba. Judged by
// boxes around shapes, so that it may be said in vain.
void report_clipping(LoadContext& context);

}  // namespace helio::mitsuba
