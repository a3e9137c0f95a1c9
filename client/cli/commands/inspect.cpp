// heliograph scene inspect: what a scene file holds, or why it is refused.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <memory>

#include "client/cli/command.h"
#include "client/cli/command_context.h"
#include "client/cli/exit_code.h"
#include "client/cli/interrupt.h"
#include "client/cli/scene_options.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

constexpr int kShownCameras = 256;

struct InspectOptions {
  SceneOptions scene;
  CommonOptions common;
};

Json to_json(const pb::Vec3& v) {
  return Json::array({v.x(), v.y(), v.z()});
}

Json to_json(const pb::SceneCamera& camera) {
  Json json;
  json["name"] = camera.name();
  json["projection"] = camera.view().orthographic_half_height() > 0 ? "orthographic" : "perspective";
  json["position"] = to_json(camera.view().position());
  if (camera.view().orthographic_half_height() > 0) {
    json["half_height"] = camera.view().orthographic_half_height();
  } else {
    json["vertical_fov"] = camera.view().vertical_fov();
  }
  json["aspect"] = camera.aspect() > 0 ? Json(camera.aspect()) : Json(nullptr);
  json["width"] = camera.width() > 0 ? Json(camera.width()) : Json(nullptr);
  json["height"] = camera.height() > 0 ? Json(camera.height()) : Json(nullptr);
  return json;
}

Json to_json(const LoadedScene& loaded) {
  const pb::SceneInfo& scene = loaded.response.scene();
  Json json;
  json["scene_id"] = scene.scene_id();
  json["name"] = scene.name();
  json["triangles"] = scene.triangles();
  json["instanced_triangles"] = scene.instanced_triangles();
  json["meshes"] = scene.meshes();
  json["instances"] = scene.instances();
  json["materials"] = scene.materials();
  json["textures"] = scene.textures();
  json["lights"] = scene.lights();
  json["cameras"] = Json::array();
  for (const pb::SceneCamera& camera : scene.cameras()) json["cameras"].push_back(to_json(camera));
  json["animations"] = Json::array();
  for (const std::string& name : scene.animations()) json["animations"].push_back(name);
  json["animation_total"] = std::max(scene.animation_total(), std::uint32_t(scene.animations_size()));
  json["animation"] = scene.animation().empty() ? Json(nullptr) : Json(scene.animation());
  json["features"] = Json::array();
  for (const std::string& feature : scene.features()) json["features"].push_back(feature);
  json["memory_bytes"] = scene.memory_bytes();
  json["bounds_min"] = to_json(scene.bounds_min());
  json["bounds_max"] = to_json(scene.bounds_max());
  json["load_seconds"] = loaded.seconds;
  json["decode_seconds"] = scene.load_seconds();
  json["build_seconds"] = scene.build_seconds();
  add_load_report(json, loaded.response);
  return json;
}

void say(Terminal& terminal, const LoadedScene& loaded) {
  const pb::SceneInfo& scene = loaded.response.scene();
  terminal.say(fmt::format("{}: {} triangles ({} as instanced), {} meshes, {} instances", scene.name(),
                           scene.triangles(), scene.instanced_triangles(), scene.meshes(), scene.instances()));
  terminal.say(
      fmt::format("  {} materials, {} textures, {} lights", scene.materials(), scene.textures(), scene.lights()));
  const pb::Vec3 &low = scene.bounds_min(), &high = scene.bounds_max();
  terminal.say(fmt::format("  bounds ({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g})", low.x(), low.y(), low.z(),
                           high.x(), high.y(), high.z()));
  int number = 0;
  for (const pb::SceneCamera& camera : scene.cameras()) {
    if (number == kShownCameras) {
      terminal.say(fmt::format("  and {} cameras more, which --camera can name; --json lists them",
                               scene.cameras_size() - number));
      break;
    }
    terminal.say(fmt::format("  camera {}: '{}'{}", number++, single_line(camera.name()),
                             camera.aspect() > 0 ? fmt::format(", aspect {:.4g}", camera.aspect()) : ""));
  }
  for (int i = 0; i < scene.animations_size(); ++i) {
    const std::string& name = scene.animations(i);
    terminal.say(fmt::format("  animation {}: '{}'{}", i, single_line(name),
                             name == scene.animation() ? ", played" : ""));
  }
  if (scene.animation_total() > std::uint32_t(scene.animations_size())) {
    terminal.say(fmt::format("  and {} animations more, which --animation can name",
                             scene.animation_total() - std::uint32_t(scene.animations_size())));
  }
  std::string features;
  for (const std::string& feature : scene.features()) features += (features.empty() ? "" : ", ") + feature;
  terminal.say("  needs: " + (features.empty() ? std::string("nothing special") : features));
  terminal.say(fmt::format("  {}B of memory; decoded in {}, built in {}", human_count(double(scene.memory_bytes())),
                           human_seconds(scene.load_seconds()), human_seconds(scene.build_seconds())));
  for (const std::string& key : loaded.response.unread()) terminal.say("  unread: " + single_line(key));
}

int run(const CLI::App& app, const InspectOptions& options) {
  CommandContext context(app, options.common);
  Terminal& terminal = context.terminal;
  Problems& problems = context.problems;
  OptionReader& reader = context.reader;
  const SceneChoice choice = read_scene(options.scene, options.common.connection, reader);
  if (!problems.empty()) return context.refuse();

  CallControl control;
  const Interrupt interrupt([&] { control.cancel(); });
  Result<Renderer> renderer = Renderer::open(context.connection);
  if (!renderer) return context.fail(renderer.error());
  const LoadOutcome outcome = load_scene(renderer->client(), choice, terminal, &control);
  if (interrupt.raised()) return terminal.fail(interrupt.exit_code(), "interrupted while loading");
  if (outcome.failure) return terminal.fail(outcome.failure->exit_code, outcome.failure->error.to_string());
  say(terminal, *outcome.scene);
  terminal.result(to_json(*outcome.scene));
  return kOk;
}

}  // namespace

Command add_scene(CLI::App& root) {
  CLI::App* scene = add_command_group(root, "scene", "Work on scene files");
  CLI::App* app = add_command(*scene, "inspect", "Load a scene and report what it holds: exit 0; or why not: exit 3",
                              kExitCodesHelp);
  auto options = std::make_shared<InspectOptions>();
  add_scene_options(*app, options->scene);
  add_common_options(*app, options->common, "One JSON object on stdout");
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
