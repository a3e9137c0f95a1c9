// --path: a camera path by name, or from a file.
#pragma once

#include <string>
#include <vector>

#include "client/camera_path.h"
#include "client/cli/options.h"
#include "client/named_paths.h"

namespace helio::cli {

// Whether the option is given and names a path (named_paths.h), not a file.
bool is_path_by_name(const TextOption& option);
// The text of the path's file; empty where there is none, or a problem was told.
std::string read_path_file(const TextOption& option, OptionReader& reader);

// What orbits turn around by default: the centre of the scene's bounds.
V3d centre_of(const heliograph::v1::SceneInfo& scene);
Result<std::vector<PathView>> path_by_name(const std::string& name, const PathScale& scale, const PathStart& start);

}  // namespace helio::cli
