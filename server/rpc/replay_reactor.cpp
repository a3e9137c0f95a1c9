#include "server/rpc/replay_reactor.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "heliograph/v1/render_service.pb.h"
#include "renderer/frame/integrate_function.h"
#include "renderer/frame/stages/trace_lights.h"
#include "renderer/trace/paths/light_vertex_cache.h"
#include "renderer/trace/paths/sample_trace.h"
#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/base/parse_message.h"
#include "server/base/retry.h"
#include "server/rpc/replay_messages.h"
#include "server/sessions/replay_token.h"

namespace helio {
namespace {

Error no_scene(const pb::SampleReplay& sample, const std::string& where) {
  return {
      ErrorCode::not_found,
      fmt::format("its scene {} is not loaded: '{}' at time {}{}, environment '{}'; load that, "
                  "unchanged and with these options, and make the same edits again where it was edited",
                  sample.scene_id().substr(0, 12), sample.main_file(), sample.time_s(),
                  sample.animation().empty() ? "" : " of animation '" + sample.animation() + "'", sample.environment()),
      where};
}

Result<pb::ReplaySampleResponse> trace(const Replay& replay, const LoadedScene& loaded, MemoryAccount& account,
                                       const CancelToken& cancel) {
  const RenderScene& scene = *loaded.snapshot;
  const Camera camera(replay.camera, replay.settings.width, replay.settings.height, scene.origin(),
                      replay.settings.filter);
  const PathSettings settings = path_settings(replay.settings);
  // Of one pass, though most_bytes() has several.
  const std::uint64_t pass = caches_light_vertices(settings.integrator) ? LightVertexSource::most_bytes(settings) : 0;
  const auto memory = account.reserve_with_room(pass, "the light paths of a replay", MemoryOwner::light_vertices);
  if (!memory) return memory.error();
  if (pass > 0) {
    // Passes are as large as the film and what their paths leave behind allow; how much that is varies with the seed.
    const std::uint64_t most =
        2 * pass_paths(std::uint64_t(settings.region.area()), mean_light_vertices(scene, settings));
    if (replay.sample.light_paths > most) {
      return Error{ErrorCode::invalid_argument,
                   fmt::format("{} in a film of {}x{}; allowed: [1, {}]", replay.sample.light_paths,
                               replay.settings.width, replay.settings.height, most),
                   "token.light_paths"};
    }
  }
  SampleTrace told;
  told.width = replay.settings.width;
  told.height = replay.settings.height;
  told.sample = replay.sample;
  if (!trace_sample(scene, camera, settings, cancel, told)) {
    return Error{ErrorCode::cancelled, "the replay was cancelled", {}};
  }
  return to_replay_response(replay, scene, settings, told);
}

}  // namespace

ReplayReactor::ReplayReactor(ServiceCore& core, grpc::CallbackServerContext& context, const grpc::ByteBuffer& request,
                             grpc::ByteBuffer* response)
    : UnaryCall(response), core_(core) {
  begin([&] { return start(context, request); });
}

Status ReplayReactor::start(grpc::CallbackServerContext& context, grpc::ByteBuffer bytes) {
  if (const Status accepting = core_.check_accepting(); !accepting.ok()) return accepting;
  pb::ReplaySampleRequest request;
  if (const Status parsed = parse_message(bytes, request); !parsed.ok()) return parsed;
  tell_ignored(context, unknown_fields(request));
  auto replay = read_replay_token(request.token(), core_.render_limits(), "token");
  if (!replay) return replay.error();
  end_by_drain(core_);
  auto scene = core_.scenes.acquire(replay->message.scene_id(), "token");
  if (!scene) return no_scene(replay->message, "token");
  struct Task {
    Replay replay;
    SceneLease scene;
  };
  auto task = std::make_shared<Task>(Task{std::move(*replay), std::move(*scene)});
  const bool taken = core_.replayer.submit([outcome = outcome(), task, &core = core_] {
    const auto answer = guarded([&] { return trace(task->replay, *task->scene, core.memory, outcome->cancel); });
    const std::string scene = task->scene->id.substr(0, 12);
    task->scene = {};  // who has the answer may unload it
    if (!answer) return outcome->fail(to_grpc_status(answer.error()));
    spdlog::info("sample replayed scene={} x={} y={} half={} index={}", scene, task->replay.sample.x,
                 task->replay.sample.y, task->replay.sample.half, task->replay.sample.index);
    outcome->finish(*answer);
  });
  if (taken) return ok_status();
  return Error{ErrorCode::resource_exhausted,
               fmt::format("max_queued_loads: {} replays wait already", core_.config.max_queued_loads),
               {},
               kRetrySeconds};
}

}  // namespace helio
