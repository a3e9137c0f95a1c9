// The edits of a scene, from messages.
#pragma once

#include <vector>

#include "heliograph/v1/render_service.pb.h"
#include "renderer/base/result.h"
#include "renderer/scene/load/scene_edit.h"
#include "server/scenes/scene_registry.h"

namespace helio {

// What can be told without the scene: a missing target, a transform of the wrong length. resolve_edits() does the rest.
std::vector<SceneEdit> read_scene_edits(const heliograph::v1::EditSceneRequest& message, Problems& problems);

heliograph::v1::EditSceneResponse to_edit_response(const LoadedScene& scene, bool already_there);

}  // namespace helio
