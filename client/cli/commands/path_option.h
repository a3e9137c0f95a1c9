// --path: a camera path by name, or from a file.
#pragma once

#include <string>
#include <vector>

#include "client/camera_path.h"
#include "client/cli/commands/output_check.h"
#include "client/cli/options.h"
#include "client/named_paths.h"

namespace helio::cli {

// Adds --path. `help` says what the command does with the path.
void add_path_option(CLI::App& app, TextOption& option, const std::string& help);

// True if the option is given and names a path (named_paths.h), not a file.
bool is_path_by_name(const TextOption& option);
// Keeps the path's file, if there is one, from being written to.
void add_path_input(const TextOption& option, OutputCheck& outputs);
// The text of the path's file; empty where there is none, or a problem was told.
std::string read_path_file(const TextOption& option, OptionReader& reader);

// --steps and --step of a path by name; problems of the scale are told before a scene is loaded.
PathScale read_path_scale(const TextOption& path, const TextOption& steps, const TextOption& step,
                          OptionReader& reader);

// The centre of the scene's bounds: the default centre of orbits.
V3d centre_of(const heliograph::v1::SceneInfo& scene);
// The views of the path that the option, which is given, names. `text`: of read_path_file(). `scale`: of a path by
// name.
Result<std::vector<PathView>> read_path_views(const TextOption& option, const std::string& text, const PathScale& scale,
                                              const PathStart& start);

}  // namespace helio::cli
