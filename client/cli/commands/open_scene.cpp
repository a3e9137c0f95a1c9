#include "client/cli/commands/open_scene.h"

#include <utility>

namespace helio::cli {

namespace pb = heliograph::v1;

std::variant<OpenScene, int> open_scene(CommandContext& context, const SettingsOptions& options,
                                        const SceneChoice& choice, CallControl& control, const Interrupt& interrupt,
                                        pb::RenderSettings& settings, const ServerCheck& check) {
  Terminal& terminal = context.terminal;
  Result<Renderer> renderer = Renderer::open(context.connection);
  if (!renderer) return context.fail(renderer.error());
  RenderClient& client = renderer->client();
  const auto info = client.server_info();
  if (!info) return context.fail(info.error());
  if (check) {
    if (const Status usable = check(client); !usable) return context.fail(usable.error());
  }
  check_against_server(options, settings, *info, context.reader);
  if (!context.problems.empty()) return context.refuse();

  LoadOutcome outcome = load_scene(client, choice, terminal, &control);
  if (interrupt.raised())
    return terminal.fail(interrupt.exit_code(), "interrupted while loading; nothing was rendered yet");
  if (outcome.failure) return terminal.fail(outcome.failure->exit_code, outcome.failure->error.to_string());
  OpenScene open{std::move(*renderer), std::move(*outcome.scene), {}, *info};
  const pb::SceneCamera* camera = choose_camera(options, open.scene(), context.reader);
  if (!camera) return context.refuse();
  set_defaults(settings, open.scene(), *camera);
  check_against_server(options, settings, *info, context.reader);
  if (!context.problems.empty()) return context.refuse();
  open.camera = *camera;
  return open;
}

}  // namespace helio::cli
