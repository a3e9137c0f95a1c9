// The scene of a command: read from this machine's disk and uploaded, or named to the daemon.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/cli/connection.h"
#include "client/cli/options.h"
#include "client/cli/terminal.h"
#include "client/local_scene.h"
#include "client/render_client.h"

namespace helio::cli {

struct SceneOptions {
  TextOption file, environment, scene_time, animation;
  bool scene_path = false, strict = false;
};
void add_scene_options(CLI::App& app, SceneOptions& options);

struct SceneChoice {
  std::string file;
  std::string environment;
  double time_s = 0;
  std::string animation;
  bool strict = false;
  bool on_server = false;
  Result<LocalScene> local = Error{};  // unless on_server: what will be uploaded, or why it cannot be
  double collect_seconds = 0;
};
// Finds the scene's files. A scene that cannot be read is no problem of the flags: load_scene tells of it.
SceneChoice read_scene(const SceneOptions& options, const ConnectionOptions& connection, OptionReader& reader);

struct LoadedScene {
  heliograph::v1::LoadSceneResponse response;
  double seconds = 0;  // wall time: finding the files, reading, uploading, decoding, building
};

// A failure with the exit code that it means: 3 for the scene, 4 for a lost server.
struct LoadFailure {
  Error error;
  int exit_code = 0;
};
// Shows the upload's progress and passes warnings and notices on. Exactly one of the two is set.
struct LoadOutcome {
  std::optional<LoadedScene> scene;
  std::optional<LoadFailure> failure;
};
LoadOutcome load_scene(RenderClient& client, const SceneChoice& choice, Terminal& terminal, CallControl* control);

std::vector<heliograph::v1::SceneCamera> cameras_of(const heliograph::v1::SceneInfo& scene);

// "NAME" of ".../NAME.gltf": what outputs are called by default.
std::string scene_stem(const SceneChoice& choice);

// Warnings, notices and unread keys of the load as JSON members.
void add_load_report(Json& json, const heliograph::v1::LoadSceneResponse& response);

}  // namespace helio::cli
