// heliograph edit: another colour, light or place in a scene that a daemon holds, without loading it again.
#include <spdlog/fmt/fmt.h>

#include <memory>

#include "client/cli/command.h"
#include "client/cli/command_context.h"
#include "client/cli/edit_options.h"
#include "client/cli/exit_code.h"
#include "client/cli/interrupt.h"
#include "client/cli/scene_options.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

struct EditCommandOptions {
  SceneOptions scene;
  TextOption scene_id, session;
  EditOptions edits;
  CommonOptions common;
};

constexpr const char* kHelp =
    "The scene is loaded where the daemon has it not yet; --scene-id names one that it has, also one that was edited.\n"
    "The edited scene gets an id of its own and shares memory with the one it was made from, which stays. --session\n"
    "switches a session to it: its picture starts over with the new scene, but in modes reproject and combined for\n"
    "what the edit leaves true.\n";

Json to_json(const pb::EditSceneResponse& edited, const std::optional<std::uint64_t>& revision) {
  const pb::SceneInfo& scene = edited.scene();
  Json json;
  json["scene_id"] = scene.scene_id();
  json["edited_from"] = scene.edited_from().empty() ? Json(nullptr) : Json(scene.edited_from());
  json["already_there"] = edited.already_there();
  json["shares_bvh"] = edited.shares_bvh();
  json["memory_bytes"] = scene.memory_bytes();
  json["own_bytes"] = scene.own_bytes();
  json["build_seconds"] = scene.build_seconds();
  json["session_revision"] = revision ? Json(*revision) : Json(nullptr);
  json["notices"] = Json::array();
  for (const std::string& text : edited.notices()) json["notices"].push_back(text);
  return json;
}

void say(Terminal& terminal, const pb::EditSceneResponse& edited, const std::string& session) {
  const pb::SceneInfo& scene = edited.scene();
  for (const std::string& text : edited.notices()) terminal.say("notice: " + single_line(text));
  terminal.say(fmt::format("scene {}{}", scene.scene_id(), edited.already_there() ? " (already there)" : ""));
  terminal.say(fmt::format("  {}B of its own, {}B in all{}; built in {}", human_count(double(scene.own_bytes())),
                           human_count(double(scene.memory_bytes())), edited.shares_bvh() ? ", BVH shared" : "",
                           human_seconds(scene.build_seconds())));
  if (!session.empty()) terminal.say("  session " + session + " renders it");
}

int run(const CLI::App& app, const EditCommandOptions& options) {
  CommandContext context(app, options.common);
  Terminal& terminal = context.terminal;
  Problems& problems = context.problems;
  OptionReader& reader = context.reader;
  const bool by_id = options.scene_id.given();
  SceneChoice choice;
  std::string scene_id = reader.text(options.scene_id).value_or("");
  if (!by_id) {
    choice = read_scene(options.scene, options.common.connection, reader);
  } else {
    if (options.scene.file.given()) reader.problem(options.scene_id, "is given beside FILE; allowed: one of them");
    if (!options.common.connection.server.given()) reader.problem(options.scene_id, "is only valid with --server");
  }
  const std::string session = reader.text(options.session).value_or("");
  if (!session.empty() && !options.common.connection.server.given()) {
    reader.problem(options.session, "is only valid with --server");
  }
  if (!options.edits.given()) {
    problems.add("edit", "nothing to change; give one of --object, --material, --light, --environment-light");
  }
  pb::EditSceneRequest request;
  for (pb::SceneEdit& edit : read_edits(options.edits, problems)) *request.add_edits() = std::move(edit);
  if (!problems.empty()) return context.refuse();

  CallControl control;
  const Interrupt interrupt([&] { control.cancel(); });
  Result<Renderer> renderer = Renderer::open(context.connection);
  if (!renderer) return context.fail(renderer.error());
  RenderClient& client = renderer->client();
  if (!by_id) {
    const LoadOutcome loaded = load_scene(client, choice, terminal, &control);
    if (interrupt.raised()) return terminal.fail(interrupt.exit_code(), "interrupted while loading");
    if (loaded.failure) return terminal.fail(loaded.failure->exit_code, loaded.failure->error.to_string());
    scene_id = loaded.scene->response.scene().scene_id();
  }
  request.set_scene_id(scene_id);
  const auto edited = client.edit_scene(request, &control);
  if (interrupt.raised()) return terminal.fail(interrupt.exit_code(), "interrupted");
  if (!edited) return context.fail(edited.error());
  std::optional<std::uint64_t> revision;
  if (!session.empty()) {
    pb::UpdateSessionRequest update;
    update.set_session_id(session);
    update.set_scene_id(edited->scene().scene_id());
    const auto updated = client.update_session(update);
    if (!updated) return context.fail(updated.error());
    revision = *updated;
  }
  say(terminal, *edited, session);
  terminal.result(to_json(*edited, revision));
  return kOk;
}

}  // namespace

Command add_edit(CLI::App& root) {
  CLI::App* app = add_command(root, "edit", "Change materials, lights or object transforms of a loaded scene",
                              std::string(kHelp) + kEditHelp + kExitCodesHelp);
  auto options = std::make_shared<EditCommandOptions>();
  add_scene_options(*app, options->scene);
  add_text(*app, options->scene_id, "--scene-id", "ID", "A scene that the daemon holds, in place of FILE");
  add_edit_options(*app, options->edits);
  add_text(*app, options->session, "--session", "ID", "Session that renders the edited scene from now on");
  add_common_options(*app, options->common, "One JSON object on stdout");
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
