#include "client/cli/open_scene.h"

#include <utility>

namespace helio::cli {

namespace pb = heliograph::v1;

std::variant<OpenScene, int> open_scene(Opening& opening, const SettingsOptions& options, const SceneChoice& choice,
                                        CallControl& control, const Interrupt& interrupt,
                                        pb::RenderSettings& settings) {
  Terminal& terminal = opening.terminal;
  Result<Renderer> renderer = Renderer::open(opening.connection);
  if (!renderer) return opening.fail(renderer.error());
  RenderClient& client = renderer->client();
  const auto info = client.server_info();
  if (!info) return opening.fail(info.error());
  check_against_server(options, settings, *info, opening.reader);
  if (!opening.problems.empty()) return opening.refuse();

  LoadOutcome outcome = load_scene(client, choice, terminal, &control);
  if (interrupt.raised())
    return terminal.fail(interrupt.exit_code(), "interrupted while loading; nothing was rendered yet");
  if (outcome.failure) return terminal.fail(outcome.failure->exit_code, outcome.failure->error.to_string());
  OpenScene open{std::move(*renderer), std::move(*outcome.scene), {}};
  const pb::SceneCamera* camera = choose_camera(options, open.scene(), opening.reader);
  if (!camera) return opening.refuse();
  set_defaults(settings, open.scene(), *camera);
  check_region(options, settings, opening.reader);
  if (!opening.problems.empty()) return opening.refuse();
  open.camera = *camera;
  return open;
}

}  // namespace helio::cli
