// What the daemon tells about a scene.
#pragma once

#include "heliograph/v1/render_service.pb.h"
#include "server/scenes/scene_registry.h"

namespace helio {

// Lists are cut, and their totals say so; cameras begin with the one of this number.
heliograph::v1::SceneInfo to_scene_info(const LoadedScene& scene, std::size_t first_camera = 0);
heliograph::v1::LoadSceneResponse to_load_response(const LoadedScene& scene, bool already_loaded);

}  // namespace helio
