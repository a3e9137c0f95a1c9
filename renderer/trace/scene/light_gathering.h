// The lights of a scene, gathered from its surfaces and its description.
#pragma once

#include <memory>

#include "renderer/trace/scene/scene_data.h"

namespace helio {

// Numbers the emissive primitives of data.flat and data.instances (first_emitter, first_emitter_slot and
// instance_emitters are set) and makes data.lights of them, of the punctual lights and of the environment. The table
// that samples an environment map is taken over from `data.lights` where it holds one for the same map and the same
// colour; its brightness does not matter.
// Preconditions: all other members are complete, but for the Accel, which is not read.
void gather_lights(SceneData& data, std::size_t emitter_count_hint);

}  // namespace helio
