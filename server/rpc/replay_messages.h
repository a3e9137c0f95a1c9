// SampleTrace -> ReplaySampleResponse.
#pragma once

#include "heliograph/v1/replay.pb.h"
#include "renderer/trace/paths/sample_trace.h"
#include "server/sessions/replay_token.h"

namespace helio {

// `settings` are those that the sample was traced with.
pb::ReplaySampleResponse to_replay_response(const Replay& replay, const RenderScene& scene,
                                            const PathSettings& settings, const SampleTrace& trace);

}  // namespace helio
