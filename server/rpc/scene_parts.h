// Answers of DescribeScene and ListFiles: what a person picks from.
#pragma once

#include "heliograph/v1/render_service.pb.h"
#include "renderer/base/result.h"
#include "server/scenes/scene_registry.h"

namespace helio {

namespace pb = heliograph::v1;

// invalid_argument: a list begins beyond its end.
Result<pb::DescribeSceneResponse> to_scene_parts(const LoadedScene& scene, const pb::DescribeSceneRequest& which);
pb::ListFilesResponse to_list(const SceneRoots::List& list);

}  // namespace helio
