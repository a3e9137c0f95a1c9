// The most that reuse could gain after a move: what no earlier view has seen must be sampled, the rest need not.
#pragma once

#include <vector>

#include "renderer/trace/camera/camera.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio::bench {

// Share, [0, 1], of the pixels of `view` whose centres show a point that none of the `before` saw within its picture:
// the nearest pixel's centre there meets the same surface within 5 % of the depth, or leaves the scene as well. All
// pictures have the size given. Lossless reuse needs this share of a restart's time to reach its error.
double newly_seen_share(const RenderScene& scene, const std::vector<CameraPose>& before, const CameraPose& view,
                        int width, int height);

}  // namespace helio::bench
