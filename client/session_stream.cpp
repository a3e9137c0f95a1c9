#include "client/session_stream.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "renderer/base/clock.h"

namespace helio {

namespace pb = heliograph::v1;

namespace {

constexpr double kFirstPauseSeconds = 0.1, kLongestPauseSeconds = 2;  // between tries

}  // namespace

struct SessionStream::Impl {
  RenderClient& client;
  const pb::StreamRequest::Open open;
  const FrameCallbacks callbacks;
  const ReattachOptions options;

  std::mutex sending;  // one at a time, in the order of the calls; taken before mutex
  std::mutex mutex;
  std::condition_variable changed;
  std::shared_ptr<FrameStream> stream;  // null: between two daemons, or over
  bool attached = false;                // opened by the daemon
  std::optional<Status> stream_end;     // of `stream`
  bool stopping = false, closing = false;
  std::optional<Status> end;
  std::optional<pb::View> view;      // the newest
  std::optional<pb::Budget> budget;  // the newest, if one was sent
  std::thread thread;

  Impl(RenderClient& client_, const pb::StreamRequest::Open& open_, FrameCallbacks callbacks_, ReattachOptions options_)
      : client(client_), open(open_), callbacks(std::move(callbacks_)), options(std::move(options_)) {}

  // On the reading thread of a stream. Nothing was sent on it so far.
  void opened(const pb::Opened& message) {
    if (callbacks.opened) callbacks.opened(message);
    const std::lock_guard in_order(sending);
    std::unique_lock lock(mutex);
    attached = true;
    const auto live = stream;
    const auto late_view = view && view->id() > message.view_id() ? view : std::nullopt;
    const auto late_budget = budget;
    changed.notify_all();
    lock.unlock();
    if (live && late_budget) (void)live->send_budget(*late_budget);
    if (live && late_view) (void)live->send_view(*late_view);
  }

  void attach() {
    FrameCallbacks mine = callbacks;
    mine.opened = [this](const pb::Opened& message) { opened(message); };
    mine.ended = [this](const Status& status) {
      const std::lock_guard lock(mutex);
      stream_end = status;
      changed.notify_all();
    };
    const std::lock_guard lock(mutex);  // the stream is known before its first callback
    stream_end.reset();
    attached = false;
    stream = client.stream_frames(open, std::move(mine));
    if (stopping || closing) stream->cancel();
  }

  // Ends the reading thread of the stream that is over. With mutex held.
  void let_go(std::unique_lock<std::mutex>& lock) {
    std::shared_ptr<FrameStream> over = std::exchange(stream, nullptr);
    attached = false;
    lock.unlock();
    over.reset();
    lock.lock();
  }

  void run() {
    Status status = ok_status();
    for (;;) {
      {
        std::unique_lock lock(mutex);
        changed.wait(lock, [this] { return stream_end.has_value(); });
        status = *stream_end;
        let_go(lock);
        // A planned restart says when to ask again.
        const bool restarts = !status && status.error().code == ErrorCode::unavailable &&
                              status.error().retry_after_s > 0;
        if (stopping || closing || !restarts || options.patience_s <= 0) break;
      }
      if (options.lost) options.lost(status);
      status = attach_again(status);
      if (!status) break;
      if (options.back) options.back();
    }
    if (callbacks.ended) callbacks.ended(status);
    const std::lock_guard lock(mutex);
    end = status;
    changed.notify_all();
  }

  Status attach_again(const Status& why) {
    const double deadline = now_s() + options.patience_s;
    double pause_s = kFirstPauseSeconds;
    Status last = why;
    for (;;) {
      std::unique_lock lock(mutex);
      const auto over = [this] { return stopping || closing; };
      if (changed.wait_for(lock, std::chrono::duration<double>(pause_s), over))
        return Error{ErrorCode::cancelled, "cancelled", {}};
      lock.unlock();
      pause_s = std::min(2 * pause_s, kLongestPauseSeconds);
      if (client.reach(std::min(kLongestPauseSeconds, deadline - now_s()))) {
        attach();
        lock.lock();
        changed.wait(lock, [this] { return attached || stream_end.has_value(); });
        if (attached && !stream_end) return ok_status();
        last = *stream_end;
        let_go(lock);
        if (last) return Error{ErrorCode::unavailable, "the server at " + client.peer() + " closed the stream", {}};
        if (last.error().code == ErrorCode::not_found) {
          return Error{ErrorCode::unavailable,
                       "the server at " + client.peer() + " came back without the session: " + last.error().message,
                       {}};
        }
        // A daemon that goes away cancels what came too late.
        if (last.error().code != ErrorCode::unavailable && last.error().code != ErrorCode::cancelled) return last;
      }
      if (now_s() >= deadline) return last;
    }
  }

  // Notes what is sent, and sends it now or once a stream is open. A stream that is over takes nothing: the
  // next one gets it, or its end is told.
  template <class Message>
  Status send(std::optional<Message>& newest, const Message& message, Status (FrameStream::*method)(const Message&)) {
    const std::lock_guard in_order(sending);
    std::unique_lock lock(mutex);
    if (end) return Error{ErrorCode::unavailable, "the stream to " + client.peer() + " is over", {}};
    newest = message;
    const auto live = attached ? stream : nullptr;
    lock.unlock();
    if (live) (void)((*live).*method)(message);
    return ok_status();
  }
};

SessionStream::SessionStream(RenderClient& client, const pb::StreamRequest::Open& open, FrameCallbacks callbacks,
                             ReattachOptions options)
    : impl_(std::make_unique<Impl>(client, open, std::move(callbacks), std::move(options))) {
  impl_->attach();
  impl_->thread = std::thread([this] { impl_->run(); });
}

SessionStream::~SessionStream() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->stopping = true;
    if (impl_->stream) impl_->stream->cancel();
    impl_->changed.notify_all();
  }
  impl_->thread.join();
}

Status SessionStream::send_view(const pb::View& view) {
  return impl_->send(impl_->view, view, &FrameStream::send_view);
}

Status SessionStream::send_budget(const pb::Budget& budget) {
  return impl_->send(impl_->budget, budget, &FrameStream::send_budget);
}

Status SessionStream::close(bool close_session) {
  std::unique_lock lock(impl_->mutex);
  if (impl_->end) return Error{ErrorCode::unavailable, "the stream to " + impl_->client.peer() + " is over", {}};
  impl_->closing = true;
  impl_->changed.notify_all();
  const auto stream = impl_->stream;
  lock.unlock();
  return stream ? stream->close(close_session) : ok_status();
}

Status SessionStream::wait() {
  std::unique_lock lock(impl_->mutex);
  impl_->changed.wait(lock, [this] { return impl_->end.has_value(); });
  return *impl_->end;
}

}  // namespace helio
