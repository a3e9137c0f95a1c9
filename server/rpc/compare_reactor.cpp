#include "server/rpc/compare_reactor.h"

#include <spdlog/spdlog.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <future>
#include <mutex>
#include <optional>
#include <utility>

#include "server/base/arena_message.h"
#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/base/log_format.h"
#include "server/base/parse_message.h"
#include "server/compare/comparison.h"
#include "server/stream/convert.h"
#include "server/stream/stream_messages.h"

namespace helio {

// The one place that writes to the call and finishes it: a comparison that outlasts its call finds no reactor any more.
class CompareReactor::Call {
 public:
  Call(CompareReactor& reactor, double patience_s)
      : cancel(std::make_shared<CancelToken>()), reactor_(&reactor), patience_s_(patience_s) {}

  // Waits for the write before. False: the call is over, or its caller takes no messages.
  bool send(const pb::CompareResponse& message) {
    grpc::ByteBuffer bytes = to_bytes(message);
    std::unique_lock lock(mutex_);
    const bool free = written_.wait_for(lock, std::chrono::duration<double>(patience_s_),
                                        [&] { return !writing_ || !reactor_ || end_; });
    if (!reactor_ || end_) return false;
    if (!free) {
      end_with({grpc::StatusCode::DEADLINE_EXCEEDED,
                fmt::format("no message was taken for {} s (request-timeout)", patience_s_)});
      return false;
    }
    message_.Swap(&bytes);
    writing_ = true;
    reactor_->StartWrite(&message_);
    return true;
  }
  void finish(const grpc::Status& status) {
    const std::lock_guard lock(mutex_);
    end_with(status);
  }
  void written(bool ok) {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    message_.Clear();
    if (!ok) cancel->cancel();
    written_.notify_all();
    finish_if_due();
  }

  const std::shared_ptr<CancelToken> cancel;

 private:
  // With mutex_ held. The first end counts.
  void end_with(const grpc::Status& status) {
    if (!end_) end_ = copy_status(status);
    written_.notify_all();
    finish_if_due();
  }
  void finish_if_due() {
    if (end_ && !writing_ && reactor_) std::exchange(reactor_, nullptr)->Finish(*end_);
  }

  std::mutex mutex_;
  std::condition_variable written_;
  CompareReactor* reactor_;  // null: finished
  const double patience_s_;
  grpc::ByteBuffer message_;  // in flight
  bool writing_ = false;
  std::optional<grpc::Status> end_;
};

CompareReactor::CompareReactor(CompareCore& compare, CallerPtr caller, grpc::CallbackServerContext& context,
                               const grpc::ByteBuffer& request)
    : compare_(compare), call_(std::make_shared<Call>(*this, compare.core.config.request_timeout_s)) {
  const auto call = call_;  // this may be gone once the call is finished
  under_way_ = compare.core.access.begin(caller, [&compare, weak = std::weak_ptr(call)](const grpc::Status& status) {
    const auto there = weak.lock();
    if (!there) return;
    there->cancel->cancel();
    there->finish(status);
    compare.queue.withdraw(*there->cancel);
  });
  if (call->cancel->cancelled()) return;
  const Status started = guarded([&] { return start(compare, *caller, context, request); });
  if (!started.ok()) call->finish(to_grpc_status(started));
}

Status CompareReactor::start(CompareCore& compare, const Caller& caller, grpc::CallbackServerContext& context,
                             const grpc::ByteBuffer& bytes) {
  ServiceCore& core = compare.core;
  if (const Status accepting = core.check_accepting(); !accepting.ok()) return accepting;
  ArenaMessage<pb::CompareRequest> message;
  grpc::ByteBuffer copy(bytes);  // shares the slices
  if (const Status parsed = parse_message(copy, *message); !parsed.ok()) return parsed;
  tell_ignored(context, unknown_fields(*message));
  Problems id;
  check_id(message->scene_id(), "scene_id", id);
  auto scene = core.scenes.acquire(message->scene_id(), "scene_id");
  auto request = read_comparison(*message, scene ? scene->get() : nullptr, compare.limits());
  if (!request) {
    if (scene) return request.error();
    const std::string missing = id.empty() ? scene.error().where + ": " + scene.error().message : id.to_error().message;
    return Error{request.error().code, missing + "; " + request.error().to_string(), {}};
  }
  if (!id.empty()) return id.to_error();
  if (!scene) return scene.error();

  static std::atomic<std::uint64_t> number{0};
  const std::string name = fmt::format("comparison-{}", ++number);
  auto counted = core.job_quota.take(caller);
  if (!counted) return counted.error();
  struct Task {
    JobQuota::Place counted;
    SceneLease scene;
    Comparison comparison;
  };
  auto snapshot = (*scene)->shared_from_this();
  auto task = std::make_shared<Task>(
      Task{std::move(*counted), std::move(*scene),
           Comparison(core.resources(caller), compare.references, snapshot, std::move(*request))});
  if (const Status there = task->comparison.take_loaded_references(); !there.ok()) return there;
  pb::CompareResponse accepted;
  *accepted.mutable_accepted() = task->comparison.accepted();
  accepted.mutable_accepted()->set_comparison_id(name);
  const auto call = call_;
  const auto greeted = std::make_shared<std::promise<void>>();  // a comparison may begin before its greeting is sent
  const auto place = compare.queue.submit(call->cancel, [call, task, name, greeted, &core] {
    greeted->get_future().wait();
    const Status ran = guarded(
        [&] { return task->comparison.run(*call->cancel, [&](const auto& message) { return call->send(message); }); });
    spdlog::info("comparison over comparison={} outcome={}", name,
                 ran.ok() ? "complete" : logged(ran.error().to_string()));
    const bool drained = !ran.ok() && ran.error().code == ErrorCode::cancelled && core.draining;
    call->finish(drained ? to_grpc_status(core.check_accepting()) : ran.ok() ? grpc::Status::OK : to_grpc_status(ran));
  });
  if (!place) return place.error();
  if (core.draining) call->cancel->cancel();  // it came too late for the drain to know of it
  accepted.mutable_accepted()->set_waits_for(std::uint32_t(*place));
  spdlog::info("comparison accepted comparison={} scene={} modes={} units={} peer={}", name,
               snapshot->id.substr(0, 12), accepted.accepted().modes_size(), accepted.accepted().units(),
               logged(context.peer()));
  call->send(accepted);
  greeted->set_value();
  return ok_status();
}

void CompareReactor::OnWriteDone(bool ok) {
  const auto call = call_;
  call->written(ok);
}

void CompareReactor::OnCancel() {
  const auto call = call_;
  CompareCore& compare = compare_;
  call->cancel->cancel();
  call->finish({grpc::StatusCode::CANCELLED, "the caller gave up"});
  compare.queue.withdraw(*call->cancel);  // its scene is let go, and its place
}

void CompareReactor::OnDone() {
  delete this;
}

}  // namespace helio
