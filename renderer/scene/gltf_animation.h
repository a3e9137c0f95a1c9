// Animations at a moment (glTF 2.0, 3.11 and appendix C).
#pragma once

#include <vector>

#include "renderer/scene/gltf_accessors.h"

namespace helio::gltf {

// Overwrites what animations drive at time_s (seconds, clamped to each sampler's first and last key). All animations
// play; where two drive the same property of a node, the first in the file does. Failures name the accessor.
void apply_animations(const Document& document, double time_s, AccessorReader& reader, Diagnostics& diagnostics,
                      std::vector<Trs>& trs, std::vector<std::vector<float>>& weights);

}  // namespace helio::gltf
