// How a scene's file wants to be rendered, for benches that show the same picture as other programs do.
#pragma once

#include "renderer/frame/render_settings.h"
#include "renderer/scene/description/scene_description.h"

namespace helio::bench {

// Longest path, roulette and filter as the file says, the rest as always: what the command takes from it
// (client/cli/render_options.h, set_defaults), but for the size, which benches choose, and with it the crop: the whole
// film is rendered. Of a file that ends no path: as many segments as integrators with light paths allow, so that all
// modes show the same picture.
RenderSettings scene_settings(const SceneDescription& scene, const CameraDescription& camera);

}  // namespace helio::bench
