// Morph targets: base + sum of weight * displacement (glTF 2.0, 3.7.2.2).
#pragma once

#include <span>

#include "renderer/scene/description/scene_description.h"
#include "renderer/scene/gltf/accessors.h"

namespace helio::gltf {

inline bool is_morphed(std::span<const float> weights) {
  for (const float weight : weights)
    if (weight != 0) return true;
  return false;
}

// Adds the weighted targets to the mesh's attributes, before normals are made unit. False after a failure.
bool apply_morph_targets(const Primitive& primitive, std::span<const float> weights, AccessorReader& reader,
                         TriangleMesh& mesh);

}  // namespace helio::gltf
