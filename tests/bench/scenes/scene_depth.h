// How far away what a view shows is: the length that camera paths are measured by.
#pragma once

#include "renderer/base/result.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio::bench {

// Mean distance, in scene units along the ray, from the camera to the first surface, over one ray through each pixel of
// a 64x64 picture (at a random place in the pixel, the same every time); rays that leave the scene do not count.
// failed_precondition: all of them do.
Result<double> scene_depth(const RenderScene& scene, const CameraPose& view);

}  // namespace helio::bench
