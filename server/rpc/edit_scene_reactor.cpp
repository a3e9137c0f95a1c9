#include "server/rpc/edit_scene_reactor.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "server/base/arena_message.h"
#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/base/parse_message.h"
#include "server/base/retry.h"
#include "server/rpc/scene_edit_messages.h"
#include "server/stream/convert.h"

namespace helio {

EditSceneReactor::EditSceneReactor(ServiceCore& core, CallerPtr caller, grpc::CallbackServerContext& context,
                                   const grpc::ByteBuffer& request, grpc::ByteBuffer* response)
    : UnaryCall(response), core_(core), caller_(std::move(caller)) {
  begin([&] { return start(context, request); });
}

Status EditSceneReactor::start(grpc::CallbackServerContext& context, grpc::ByteBuffer bytes) {
  if (const Status accepting = core_.check_accepting(); !accepting.ok()) return accepting;
  ArenaMessage<pb::EditSceneRequest> held;
  const pb::EditSceneRequest& request = *held;
  if (const Status parsed = parse_message(bytes, *held); !parsed.ok()) return parsed;
  tell_ignored(context, unknown_fields(request));
  Problems problems;
  check_id(request.scene_id(), "scene_id", problems);
  auto edits = std::make_shared<const std::vector<SceneEdit>>(read_scene_edits(request, problems));
  if (!problems.empty()) return problems.to_error();
  // Kept until the task has run, so that the scene is not unloaded meanwhile; not longer, for who has the answer may
  // unload it.
  end_by_drain(core_);
  auto base = core_.scenes.acquire(request.scene_id(), "scene_id");
  if (!base) return base.error();
  auto lease = std::make_shared<SceneLease>(std::move(*base));
  ServiceCore& core = core_;
  const bool taken = core_.editor.submit([outcome = outcome(), lease, edits, &core, caller = caller_] {
    const auto answer = guarded([&]() -> Result<pb::EditSceneResponse> {
      const SceneLease scene = std::move(*lease);
      if (const Status accepting = core.check_accepting(); !accepting.ok()) return accepting.error();
      const auto edit = core.scenes.edit(scene, *edits, outcome->cancel);
      if (!edit) return edit.error();
      const LoadedScene& edited = *edit->scene;
      edited.owners.add(caller->name);
      spdlog::info("scene {} scene={} from={} own_bytes={} build_s={:.3f}",
                   edit->already_loaded ? "already edited" : "edited", edited.id.substr(0, 12), scene->id.substr(0, 12),
                   edited.snapshot->stats().own_bytes, edited.snapshot->stats().build_seconds);
      return to_edit_response(edited, edit->already_loaded);
    });
    if (!answer) return outcome->fail(to_grpc_status(answer.error()));
    outcome->finish(*answer);
  });
  if (taken) return ok_status();
  if (const Status accepting = core_.check_accepting(); !accepting.ok()) return accepting;
  return Error{ErrorCode::resource_exhausted,
               fmt::format("max_queued_loads: {} edits wait already", core_.config.max_queued_loads),
               {},
               kRetrySeconds};
}

}  // namespace helio
