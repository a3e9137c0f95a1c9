// Our own BVH of a scene, for devices without acceleration structures: one tree over flat triangles and spheres, one
// for each instanced object, and one over the instances.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"
#include "renderer/vulkan/device/arena.h"
#include "renderer/vulkan/scene/geometry_tables.h"
#include "renderer/vulkan/shaders/tables/geometry.h"

namespace helio::vulkan {

struct SceneBvh {
  std::vector<BvhNode> nodes;
  std::vector<BvhTriangle> triangles;

  std::uint64_t bytes() const { return nodes.size() * sizeof(BvhNode) + triangles.size() * sizeof(BvhTriangle); }
};

struct SceneBvhOptions {
  int threads = 0;  // at most so many; 0: all
  const CancelToken* cancel = nullptr;
};

// Builds the trees, and sets their roots in `geometry`. Errors: resource_exhausted (too many triangles for references
// of 27 bits, host memory), cancelled.
Result<SceneBvh> build_bvh(SceneGeometry& geometry, const SceneBvhOptions& options = {});

// Uploads the trees and sets their addresses in `geometry.tables`.
Status upload_bvh(const SceneBvh& bvh, SceneGeometry& geometry, Arena& arena);

}  // namespace helio::vulkan
