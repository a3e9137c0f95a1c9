// Emitters that stand alone: point, spot, directional, projector, constant, envmap. Those of shapes are read with the
// shapes.
#pragma once

#include "renderer/scene/mitsuba/context.h"

namespace helio::mitsuba {

// Adds the light to the scene. `own_environment`: false leaves constant and envmap out (the caller gives another).
void read_emitter(const Element& element, bool own_environment, LoadContext& context);

}  // namespace helio::mitsuba
