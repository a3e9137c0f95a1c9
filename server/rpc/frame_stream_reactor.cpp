#include "server/rpc/frame_stream_reactor.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "server/base/arena_message.h"
#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/base/parse_message.h"
#include "server/rpc/call_rights.h"
#include "server/rpc/ended_by_reload.h"
#include "server/stream/convert.h"
#include "server/stream/stream_messages.h"

namespace helio {
namespace {

constexpr std::uint32_t kMaxCredit = 65536;

Error out_of_order(std::string message) {
  return {ErrorCode::failed_precondition, std::move(message), "request"};
}

}  // namespace

FrameStreamReactor::FrameStreamReactor(ServiceCore& core, CallerPtr caller) : core_(core), caller_(std::move(caller)) {
  stream_ = std::make_shared<OutboundStream>(
      static_cast<OutboundStream::Call&>(*this),
      [this](Outbound message) { return to_stream_response(std::move(message), session_id_); }, core.timers,
      &core.counters.streams);
  under_way_ = core.access.begin(caller_, end_of(stream_));
  if (const Status accepting = core.check_accepting(); !accepting.ok()) {
    end(to_grpc_status(accepting));
  } else {
    unopened_ = core.open_calls.add([weak = std::weak_ptr(stream_), &core] {
      if (const auto stream = weak.lock()) stream->finish(to_grpc_status(core.check_accepting()));
    });
    const double seconds = core.config.request_timeout_s;
    open_due_ = std::make_unique<ReadDeadline>(core.timers, seconds, [weak = std::weak_ptr(stream_), seconds] {
      const auto stream = weak.lock();
      if (!stream) return;
      stream->finish({grpc::StatusCode::DEADLINE_EXCEEDED,
                      fmt::format("the stream sent no open within {} s (request-timeout)", seconds)});
    });
    open_due_->start();
    StartRead(&request_);
  }
}

TaskThread* FrameStreamReactor::thread_for(const pb::StreamRequest& request) const {
  if (request.has_settings()) return &core_.thread_for(request.settings().device());
  const auto attached = session();
  return request.has_scene() && attached ? core_.thread_for_scene(*attached) : nullptr;
}

void FrameStreamReactor::OnReadDone(bool ok) {
  if (!ok) {
    if (const auto attached = session()) {
      attached->finish_after_frame(stream_);
    } else {
      end(to_grpc_status(out_of_order("the stream ended before open")));
    }
    return;
  }
  const Status handled = guarded([&]() -> Status {
    auto request = make_arena_message<pb::StreamRequest>();
    if (const Status parsed = parse_message(request_, *request); !parsed.ok()) return parsed;
    request_.Clear();
    note_unknown(*request);
    if (TaskThread* const thread = thread_for(*request)) {
      handle_later(*thread, std::move(request));
    } else if (handle(*request)) {
      tell_ignored();
      StartRead(&request_);
    }
    return ok_status();
  });
  if (!handled.ok()) end(to_grpc_status(handled));
}

void FrameStreamReactor::handle_later(TaskThread& thread, std::shared_ptr<const pb::StreamRequest> request) {
  if (!hold_.begin()) return;
  const auto over = [this](bool read_on) {
    auto status = hold_.end([&] {
      if (read_on) StartRead(&request_);
    });
    if (status) Finish(*std::move(status));  // this may be gone now
  };
  const Status taken = guarded([&]() -> Status {
    const bool submitted = thread.submit([this, request = std::move(request), over] {
      bool read_on = false;
      const Status handled = guarded([&] {
        read_on = handle(*request);
        if (read_on) tell_ignored();
        return ok_status();
      });
      if (!handled.ok()) end(to_grpc_status(handled));
      over(read_on && handled.ok());
    });
    if (submitted) return ok_status();
    return core_.too_many_waiting();
  });
  if (taken.ok()) return;
  end(to_grpc_status(taken));
  over(false);
}

void FrameStreamReactor::note_unknown(const pb::StreamRequest& request) {
  for (std::string& field : unknown_fields(request)) {
    if (ignored_.size() >= kMaxUnknownFields) return;
    if (std::find(ignored_.begin(), ignored_.end(), field) != ignored_.end()) continue;
    ignored_.push_back(std::move(field));
    ignored_is_told_ = false;
  }
}

// Names all of them again: a notice replaces one that still waits.
void FrameStreamReactor::tell_ignored() {
  if (ignored_is_told_ || !session()) return;
  ignored_is_told_ = true;
  stream_->push(ignored_fields_notice(ignored_));
}

bool FrameStreamReactor::handle(const pb::StreamRequest& request) {
  const auto attached = session();
  // A request of a kind that only newer daemons know.
  if (request.request_case() == pb::StreamRequest::REQUEST_NOT_SET && !unknown_fields(request).empty()) return true;
  if (!attached && request.request_case() != pb::StreamRequest::kOpen) {
    end(to_grpc_status(out_of_order("the first message is not open")));
    return false;
  }
  Status status = ok_status();
  Session::Change change;
  SceneLease scene;
  switch (request.request_case()) {
    case pb::StreamRequest::kOpen:
      status = attached ? Status(out_of_order("open was sent before; allowed: once, as the first message"))
                        : guarded([&] { return open(request.open()); });
      break;
    case pb::StreamRequest::kView:
      change.view = &request.view();
      break;
    case pb::StreamRequest::kSettings:
      change.settings = &request.settings();
      break;
    case pb::StreamRequest::kGaze:
      change.gaze = &request.gaze();
      break;
    case pb::StreamRequest::kBudget:
      change.budget = &request.budget();
      break;
    case pb::StreamRequest::kCredit: {
      const std::uint32_t tiles = request.credit().tiles();
      if (tiles < 1 || tiles > kMaxCredit) {
        status =
            Error{ErrorCode::invalid_argument, fmt::format("{}; allowed: [1, {}]", tiles, kMaxCredit), "credit.tiles"};
      } else if (!stream_->queue().add_credit(tiles)) {
        status = Error{ErrorCode::invalid_argument, "this stream was opened without credit", "credit"};
      } else {
        stream_->kick();
      }
      break;
    }
    case pb::StreamRequest::kScene: {
      Problems problems;
      check_id(request.scene().scene_id(), "scene.scene_id", problems);
      if (!problems.empty()) {
        status = problems.to_error();
        break;
      }
      auto found = core_.scenes.acquire(request.scene().scene_id(), "scene.scene_id");
      if (!found) {
        status = found.error();
        break;
      }
      scene = std::move(*found);
      change.scene = &scene;
      break;
    }
    case pb::StreamRequest::kClose:
      if (request.close().close_session()) {
        (void)core_.sessions.close(session_id_, "session_id", grpc::Status::OK);
        spdlog::info("session closed session={}", session_id_);
      }
      end(grpc::Status::OK);
      return false;
    case pb::StreamRequest::REQUEST_NOT_SET:
      status = Error{ErrorCode::invalid_argument,
                     "is empty; allowed: one of open, view, settings, budget, credit, gaze, close, scene", "request"};
      break;
  }
  if (status.ok() && (change.view || change.settings || change.budget || change.scene || change.gaze)) {
    const auto revision = guarded([&] { return attached->update(change); });
    if (!revision) status = revision.error();
  }
  if (!status.ok()) end(to_grpc_status(status));
  return status.ok();
}

Status FrameStreamReactor::open(const pb::StreamRequest::Open& open) {
  Problems problems;
  check_id(open.session_id(), "open.session_id", problems);
  const TileFormat format = read_tile_format(open.format(), "open.format", problems, core_.oidn != nullptr);
  if (open.credit() > kMaxCredit) {
    problems.add("open.credit", fmt::format("{}; allowed: [1, {}], or 0 for none", open.credit(), kMaxCredit));
  }
  if (!problems.empty()) return problems.to_error();
  auto found = core_.sessions.find(open.session_id(), "open.session_id");
  if (!found) return found.error();
  const Status own = check_owner(*caller_, (*found)->owner(), "session '" + open.session_id() + "'");
  if (!own.ok()) return own;
  session_id_ = open.session_id();
  if (open.credit() > 0) stream_->queue().limit_credit(open.credit());
  if (!open_due_->stop()) return Error{ErrorCode::unavailable, "open came too late", "request"};
  {
    const std::lock_guard lock(mutex_);
    session_ = *found;
  }
  unopened_.reset();
  if (const Status attached = (*found)->attach(stream_, format); !attached.ok()) return attached;
  return core_.check_accepting();  // a drain has told its session before, or finds the stream there
}

void FrameStreamReactor::OnCancel() {
  end({grpc::StatusCode::CANCELLED, "the caller gave up"});
}

// The session is let go of now: a client that reads nothing may keep the call from being done for long.
void FrameStreamReactor::end(const grpc::Status& status) {
  leave_session();
  stream_->finish(status);
}

void FrameStreamReactor::leave_session() {
  std::shared_ptr<Session> attached;
  {
    const std::lock_guard lock(mutex_);
    attached = std::move(session_);
  }
  if (attached) attached->detach(stream_.get());
}

void FrameStreamReactor::OnDone() {
  hold_.wait();
  leave_session();
  delete this;
}

std::shared_ptr<Session> FrameStreamReactor::session() const {
  const std::lock_guard lock(mutex_);
  return session_;
}

}  // namespace helio
