// heliograph replay: one sample again, told vertex by vertex.
#include <google/protobuf/util/json_util.h>
#include <spdlog/fmt/fmt.h>

#include <memory>

#include "client/cli/command.h"
#include "client/cli/command_context.h"
#include "client/cli/commands/replay_report.h"
#include "client/cli/exit_code.h"
#include "client/cli/interrupt.h"
#include "client/cli/scene_options.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

struct ReplayOptions {
  TextOption token;
  SceneOptions scene;
  CommonOptions common;
};

constexpr const char* kHelp =
    "A render or a frame that met a NaN or infinite sample left it out of the picture and gave a token for the first\n"
    "one (replay_token). The token holds film, camera, settings and sample; the scene has to be given as it was then:\n"
    "the same files, --environment, --scene-time and --animation. With --server, FILE may be left\n"
    "out where the daemon still has the scene. Of a picture with light paths it also tells the light path that goes\n"
    "with the sample, and where the two are joined.\n"
    "Positions are world coordinates, pdfs per steradian. With --json, stdout holds one object: ReplaySampleResponse "
    "of\n"
    "proto/heliograph/v1/replay.proto, members that are zero, false or empty left out.\n"
    "Example: heliograph replay hg1-CkA0YjE... room.glb\n\n";

Json to_json(const pb::ReplaySampleResponse& replay) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string text;
  if (!google::protobuf::util::MessageToJsonString(replay, &text, options).ok()) return Json::object();
  return Json::parse(text, nullptr, false);
}

void say(Terminal& terminal, const pb::ReplaySampleResponse& replay) {
  terminal.say(describe_sample(replay));
  const bool on_light_path = replay.first_not_finite_on_light_path();
  for (const pb::TracedLightVertex& vertex : replay.light_vertices()) {
    const bool here = on_light_path && vertex.number() == replay.first_not_finite_vertex();
    terminal.say(describe_light_vertex(vertex, here ? replay.first_not_finite() : std::string()));
  }
  for (const pb::TracedVertex& vertex : replay.vertices()) {
    const bool here = !on_light_path && vertex.number() == replay.first_not_finite_vertex();
    terminal.say(describe_vertex(vertex, here ? replay.first_not_finite() : std::string()));
  }
  if (replay.vertices_left_out() > 0) {
    terminal.say(fmt::format("and {} vertices more", replay.vertices_left_out()));
  }
}

int run(const CLI::App& app, const ReplayOptions& options) {
  CommandContext context(app, options.common);
  Terminal& terminal = context.terminal;
  Problems& problems = context.problems;
  OptionReader& reader = context.reader;
  std::string token;
  if (options.token.given()) {
    token = reader.text(options.token).value_or("");
  } else {
    problems.add("TOKEN", "is missing: the replay_token of a render");
  }
  // A daemon may still have the scene.
  const bool with_scene = options.scene.file.given() || !options.common.connection.server.given();
  SceneChoice choice;
  if (with_scene) {
    choice = read_scene(options.scene, options.common.connection, reader);
  } else {
    const SceneOptions& scene = options.scene;
    for (const TextOption* option : {&scene.environment, &scene.scene_time, &scene.animation}) {
      if (option->given()) reader.problem(*option, "is only valid with FILE");
    }
    if (scene.scene_path) problems.add("--scene-path", "is only valid with FILE");
    if (scene.strict) problems.add("--strict", "is only valid with FILE");
  }
  if (!problems.empty()) return context.refuse();

  CallControl control;
  const Interrupt interrupt([&] { control.cancel(); });
  Result<Renderer> renderer = Renderer::open(context.connection);
  if (!renderer) return context.fail(renderer.error());
  if (with_scene) {
    const LoadOutcome loaded = load_scene(renderer->client(), choice, terminal, &control);
    if (interrupt.raised()) return terminal.fail(interrupt.exit_code(), "interrupted while loading");
    if (loaded.failure) return terminal.fail(loaded.failure->exit_code, loaded.failure->error.to_string());
  }
  const auto replay = renderer->client().replay_sample(token, &control);
  if (interrupt.raised()) return terminal.fail(interrupt.exit_code(), "interrupted");
  if (!replay) {
    const bool other_scene = with_scene && replay.error().code == ErrorCode::not_found;
    if (!other_scene) return context.fail(replay.error());
    return terminal.fail(kSceneRefused, choice.file + " is not the token's scene; " + replay.error().to_string());
  }
  if (!replay->note().empty()) terminal.warn(replay->note());
  say(terminal, *replay);
  terminal.result(to_json(*replay));
  return kOk;
}

}  // namespace

Command add_replay(CLI::App& root) {
  CLI::App* app = add_command(root, "replay", "Trace one sample again, named by a token, and tell every vertex",
                              std::string(kHelp) + kExitCodesHelp);
  auto options = std::make_shared<ReplayOptions>();
  add_text(*app, options->token, "TOKEN", "", "What a render with invalid samples gave. Required");
  add_scene_options(*app, options->scene);
  add_common_options(*app, options->common, "One JSON object on stdout");
  return {app, [app, options] { return run(*app, *options); }};
}

}  // namespace helio::cli
