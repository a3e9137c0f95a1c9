// Where every node stands at one moment: rest transforms, animations on top, products down the hierarchy.
#pragma once

#include <vector>

#include "renderer/scene/gltf_accessors.h"

namespace helio::gltf {

struct Pose {
  std::vector<M44d> to_world;               // by node; row vectors
  std::vector<std::vector<float>> weights;  // by node: morph weights in force; empty without mesh or targets
};

// Row-vector matrix of scale, then rotation, then translation.
M44d to_matrix(const Trs& trs);

// Failures: broken animation data, a transform that overflows.
Pose evaluate_pose(const Document& document, double time_s, AccessorReader& reader, Diagnostics& diagnostics);

}  // namespace helio::gltf
