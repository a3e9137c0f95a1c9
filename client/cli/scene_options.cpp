#include "client/cli/scene_options.h"

#include <spdlog/fmt/fmt.h>

#include <filesystem>

#include "client/cli/exit_code.h"
#include "client/enum_names.h"
#include "client/environment_text.h"
#include "renderer/base/clock.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

constexpr int kShownUnread = 5;

LoadFailure to_failure(Error error) {
  if (error.code == ErrorCode::unavailable) return {std::move(error), kUnreachable};
  return {std::move(error), kSceneRefused};
}

void report(const pb::LoadSceneResponse& response, Terminal& terminal) {
  for (const std::string& text : response.warnings()) terminal.warn(text);
  for (const std::string& text : response.notices()) terminal.say("notice: " + single_line(text));
  if (response.unread_size() == 0) return;
  std::string keys;
  for (int i = 0; i < std::min(response.unread_size(), kShownUnread); ++i) keys += (i ? ", " : "") + response.unread(i);
  if (response.unread_size() > kShownUnread) {
    const int total = std::max(response.unread_size(), static_cast<int>(response.unread_total()));
    keys += fmt::format(" and {} more (scene inspect lists them)", total - kShownUnread);
  }
  terminal.warn("nothing reads " + keys);
}

}  // namespace

void add_scene_options(CLI::App& app, SceneOptions& options) {
  add_text(app, options.file, "FILE", "",
           "Scene: glTF 2.0 (.gltf with its files, or .glb) or Mitsuba (.xml with its files). Required");
  add_text(app, options.environment, "--environment", "FILE.exr|R,G,B",
           "Light from everywhere: a latitude-longitude map, or a constant radiance, each number in [0, 3.4e38]. Sets "
           "or replaces the scene's own");
  add_text(app, options.scene_time, "--scene-time", "SECONDS", "The animation is evaluated at this time. Default: 0");
  add_text(app, options.animation, "--animation", "NAME",
           "Animation (clip) to play, by name or number from 0. Default: the first that moves anything");
  add_flag(app, options.strict, "--strict",
           "Refuse a file that breaks a rule of its format, even where its meaning is beyond doubt. Default: warn");
  add_flag(app, options.scene_path, "--scene-path",
           "FILE (and a map given to --environment) is a path under the daemon's scene roots, not on this machine");
}

SceneChoice read_scene(const SceneOptions& options, const ConnectionOptions& connection, OptionReader& reader) {
  SceneChoice choice;
  if (options.file.given()) {
    choice.file = reader.text(options.file).value_or("");
  } else {
    reader.problems().add("FILE", "is missing: the scene to load");
  }
  choice.environment = reader.text(options.environment).value_or("");
  choice.animation = reader.text(options.animation).value_or("");
  choice.strict = options.strict;
  choice.time_s = reader.number(options.scene_time, kAnyNumber).value_or(0);
  choice.on_server = options.scene_path;
  if (options.scene_path && !connection.server.given() && !connection.needs_daemon) {
    reader.problems().add("--scene-path", "is only valid with --server");
  }
  if (const auto names_map = names_environment_map(choice.environment); !names_map) {
    reader.problem(options.environment, names_map.error().message);
  } else if (!choice.on_server) {
    const double start = now_s();
    choice.local = collect_local_scene(choice.file, choice.environment);
    choice.collect_seconds = now_s() - start;
    if (!choice.local && choice.local.error().where == "environment") {
      reader.problem(options.environment, choice.local.error().message);
    }
  }
  return choice;
}

LoadOutcome load_scene(RenderClient& client, const SceneChoice& choice, Terminal& terminal, CallControl* control) {
  const double start = now_s();
  SceneLoadRequest request;
  request.time_s = choice.time_s;
  request.animation = choice.animation;
  request.strict = choice.strict;
  request.uploaded = [&](std::uint64_t sent, std::uint64_t total) {
    terminal.progress(sent < total ? fmt::format("sending the scene: {:.0f} % of {}B", 100.0 * sent / total,
                                                 human_count(static_cast<double>(total)))
                                   : std::string("loading the scene"));
  };
  Result<pb::LoadSceneResponse> response = Error{};
  if (choice.on_server) {
    terminal.progress("loading the scene");
    response = client.load_server_scene(choice.file, choice.environment, request, control);
  } else {
    if (!choice.local) return {std::nullopt, to_failure(choice.local.error())};
    response = client.upload_scene(*choice.local, request, control);
  }
  terminal.end_progress();
  if (!response) return {std::nullopt, to_failure(response.error())};
  if (Status all = client.complete_cameras(*response->mutable_scene()); !all) {
    return {std::nullopt, to_failure(all.error())};
  }
  const double seconds = choice.collect_seconds + now_s() - start;
  report(*response, terminal);
  return {LoadedScene{std::move(response).value(), seconds}, std::nullopt};
}

std::vector<pb::SceneCamera> cameras_of(const pb::SceneInfo& scene) {
  return {scene.cameras().begin(), scene.cameras().end()};
}

std::string scene_stem(const SceneChoice& choice) {
  const std::string stem = std::filesystem::path(choice.file).stem().string();
  return stem.empty() ? "picture" : stem;
}

void add_load_report(Json& json, const pb::LoadSceneResponse& response) {
  // A daemon of an older version does not say how many there are.
  const auto total = [](std::uint32_t said, int listed) { return said > 0 ? said : std::uint32_t(listed); };
  json["warnings_total"] = total(response.warnings_total(), response.warnings_size());
  json["notices_total"] = total(response.notices_total(), response.notices_size());
  json["unread_total"] = total(response.unread_total(), response.unread_size());
  json["warnings"] = Json::array();
  for (const std::string& text : response.warnings()) json["warnings"].push_back(text);
  json["notices"] = Json::array();
  for (const std::string& text : response.notices()) json["notices"].push_back(text);
  json["unread"] = Json::array();
  for (const std::string& text : response.unread()) json["unread"].push_back(text);
}

}  // namespace helio::cli
