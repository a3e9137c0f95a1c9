// Where every node stands at one moment: rest transforms, an animation on top, products down the hierarchy.
#pragma once

#include <vector>

#include "renderer/scene/gltf/accessors.h"

namespace helio::gltf {

struct Pose {
  std::vector<M44d> to_world;               // by node; row vectors
  std::vector<bool> mirrored;               // by node: an odd number of scales above it and of its own is below 0
  std::vector<Trs> trs;                     // by node: local, as animated
  std::vector<std::vector<float>> weights;  // by node: morph weights in force; empty without mesh or targets
};

// `animation`: the one that plays, -1: none. Failures: broken animation data, a transform that overflows.
Pose evaluate_pose(const Document& document, int animation, double time_s, AccessorReader& reader,
                   Diagnostics& diagnostics);

// Where lights and cameras look to, which scale does not change, by node: as to_world, but for scales of 0, which count
// as 1. Numbers may be infinite.
std::vector<M44d> unflattened(const Document& document, const Pose& pose);

}  // namespace helio::gltf
