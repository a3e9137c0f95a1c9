// The text by which one sample of one picture can be traced again: see proto/heliograph/v1/replay.proto.
//
// A token holds everything but the scene, which it names by its content; so it outlives the session, the job and the
// daemon. It carries no secret, but the names that the scene was loaded by.
#pragma once

#include <string>

#include "heliograph/v1/replay.pb.h"
#include "renderer/base/result.h"
#include "renderer/frame/frame_sink.h"
#include "renderer/frame/render_settings.h"
#include "server/scenes/scene_registry.h"

namespace helio {

namespace pb = heliograph::v1;

// `frame`: that the sample belongs to.
std::string make_replay_token(const LoadedScene& scene, const FrameBegin& frame, const InvalidSample& sample);

struct Replay {
  pb::SampleReplay message;
  RenderSettings settings;
  CameraPose camera;
  InvalidSample sample;  // inside the film
};

// invalid_argument: no token, one that was cut or mistyped, or every field out of range. `where` prefixes the fields.
Result<Replay> read_replay_token(const std::string& token, const RenderLimits& limits, const std::string& where);

// Why this daemon's bits may differ from those that were rendered; empty: they do not.
std::string replay_note(const pb::SampleReplay& message);

}  // namespace helio
