#include "server/edit_scene_reactor.h"

#include <spdlog/spdlog.h>

#include <mutex>
#include <utility>

#include "server/convert.h"
#include "server/grpc_status.h"
#include "server/guarded.h"
#include "server/message_check.h"
#include "server/scene_edit_messages.h"
#include "server/stream_messages.h"

namespace helio {

// The call ends once, by the task or by the caller.
struct EditSceneReactor::Shared {
  std::mutex mutex;
  EditSceneReactor* reactor = nullptr;  // null: finished
  grpc::ByteBuffer* response = nullptr;
  CancelToken cancel;

  void finish(const grpc::Status& status, const pb::EditSceneResponse* answer = nullptr) {
    const std::lock_guard lock(mutex);
    if (!reactor) return;
    if (answer) *response = to_bytes(*answer);
    std::exchange(reactor, nullptr)->Finish(status);
  }
};

EditSceneReactor::EditSceneReactor(ServiceCore& core, const grpc::ByteBuffer& request, grpc::ByteBuffer* response)
    : core_(core), shared_(std::make_shared<Shared>()) {
  shared_->reactor = this;
  shared_->response = response;
  const auto shared = shared_;  // this may be gone once the task is submitted
  const Status started = guarded([&] { return start(request); });
  if (!started.ok()) shared->finish(to_grpc_status(started));
}

Status EditSceneReactor::start(grpc::ByteBuffer bytes) {
  if (const Status accepting = core_.check_accepting(); !accepting.ok()) return accepting;
  pb::EditSceneRequest request;
  if (const Status parsed = parse_message(bytes, request); !parsed.ok()) return parsed;
  Problems problems;
  check_id(request.scene_id(), "scene_id", problems);
  auto edits = std::make_shared<const std::vector<SceneEdit>>(read_scene_edits(request, problems));
  if (!problems.empty()) return problems.to_error();
  // Kept until the task has run, so that the scene is not unloaded meanwhile.
  auto base = core_.scenes.acquire(request.scene_id(), "scene_id");
  if (!base) return base.error();
  auto scene = std::make_shared<const SceneLease>(std::move(*base));
  ServiceCore& core = core_;
  const bool taken = core_.loader.submit([shared = shared_, scene, edits, &core] {
    if (const Status accepting = core.check_accepting(); !accepting.ok()) {
      return shared->finish(to_grpc_status(accepting));
    }
    const auto outcome = guarded([&] { return core.scenes.edit(*scene, *edits, shared->cancel); });
    if (!outcome) return shared->finish(to_grpc_status(outcome.error()));
    const LoadedScene& edited = *outcome->scene;
    spdlog::info("scene {} id={} from={} own_bytes={} build_s={:.3f}",
                 outcome->already_loaded ? "already edited" : "edited", edited.id.substr(0, 12),
                 (*scene)->id.substr(0, 12), edited.snapshot->stats().own_bytes,
                 edited.snapshot->stats().build_seconds);
    const pb::EditSceneResponse answer = to_edit_response(edited, outcome->already_loaded);
    shared->finish(grpc::Status::OK, &answer);
  });
  if (taken) return ok_status();
  if (const Status accepting = core_.check_accepting(); !accepting.ok()) return accepting;
  return Error{ErrorCode::resource_exhausted,
               fmt::format("max_queued_loads: {} loads and edits wait already", core_.config.max_queued_loads),
               {}};
}

void EditSceneReactor::OnCancel() {
  shared_->cancel.cancel();
  shared_->finish({grpc::StatusCode::CANCELLED, "the caller gave up"});
}

void EditSceneReactor::OnDone() {
  delete this;
}

}  // namespace helio
