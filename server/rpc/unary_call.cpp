#include "server/rpc/unary_call.h"

#include <utility>

#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/stream/stream_messages.h"

namespace helio {

void UnaryCall::Outcome::finish(const google::protobuf::MessageLite& answer) {
  const std::lock_guard lock(mutex_);
  if (!call_) return;
  const Status written = guarded([&] {
    response_ = to_bytes(answer);
    return ok_status();
  });
  std::exchange(call_, nullptr)->Finish(to_grpc_status(written));
}

void UnaryCall::Outcome::fail(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  if (call_) std::exchange(call_, nullptr)->Finish(copy_status(status));
}

UnaryCall::UnaryCall(grpc::ByteBuffer* response) : outcome_(std::make_shared<Outcome>(*this, *response)) {}

void UnaryCall::begin(const std::function<Status()>& start) {
  const auto outcome = outcome_;  // this may be gone once the task is submitted
  const Status started = guarded(start);
  if (!started.ok()) outcome->fail(to_grpc_status(started));
}

void UnaryCall::end_by_drain(ServiceCore& core) {
  outcome_->place = core.open_calls.add([weak = std::weak_ptr(outcome_), &core] {
    const auto outcome = weak.lock();
    if (!outcome) return;
    outcome->cancel.cancel();
    outcome->fail(to_grpc_status(core.check_accepting()));
  });
}

void UnaryCall::OnCancel() {
  outcome_->cancel.cancel();
  outcome_->fail({grpc::StatusCode::CANCELLED, "the caller gave up"});
}

}  // namespace helio
