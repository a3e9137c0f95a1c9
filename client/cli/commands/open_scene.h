// A renderer with a command's scene in it.
#pragma once

#include <functional>
#include <variant>

#include "client/cli/command_context.h"
#include "client/cli/interrupt.h"
#include "client/cli/render_options.h"
#include "client/cli/scene_options.h"

namespace helio::cli {

struct OpenScene {
  Renderer renderer;
  LoadedScene loaded;
  heliograph::v1::SceneCamera camera;  // the chosen one
  heliograph::v1::GetServerInfoResponse server;

  const heliograph::v1::SceneInfo& scene() const { return loaded.response.scene(); }
};

// Checks what a command needs of the server beside the settings, before anything is sent to it.
using ServerCheck = std::function<Status(RenderClient& client)>;

// Connects, loads the scene, and makes the settings whole by what server and camera say. An exit code: something is
// wrong, and has been said.
std::variant<OpenScene, int> open_scene(CommandContext& context, const SettingsOptions& options,
                                        const SceneChoice& choice, CallControl& control, const Interrupt& interrupt,
                                        heliograph::v1::RenderSettings& settings, const ServerCheck& check = {});

}  // namespace helio::cli
