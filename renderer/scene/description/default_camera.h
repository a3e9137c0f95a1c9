// A camera for scenes that bring none: the whole bounding box in view.
#pragma once

#include "renderer/scene/description/scene_description.h"

namespace helio {

// World bounds of each instance; empty (isEmpty()) where its object has no geometry.
std::vector<Box3d> instance_bounds(const SceneDescription& scene);

// World bounds of all instances; empty (isEmpty()) for a scene without geometry.
Box3d scene_bounds(const SceneDescription& scene);

// Looks at the bounds' centre from the front (+z), somewhat from the right and from above, close enough that the
// projected box fills a square picture but for a 5 % margin. An empty box counts as the unit cube around the origin.
CameraDescription frame_bounds(const Box3d& bounds);

}  // namespace helio
