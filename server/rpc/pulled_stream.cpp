#include "server/rpc/pulled_stream.h"

#include <mutex>
#include <utility>

#include "server/base/grpc_status.h"
#include "server/base/guarded.h"

namespace helio {

class PulledStream::Shared final : public Waker, public std::enable_shared_from_this<Shared> {
 public:
  Shared(PulledStream& stream, TaskThread& threads, Error full, Make make)
      : threads_(threads), full_(std::move(full)), make_(std::move(make)), stream_(&stream) {}

  void wake() override {
    const std::lock_guard lock(mutex_);
    if (!stream_) return;
    if (pulling_ || writing_) {
      again_ = true;
    } else {
      pull();
    }
  }

  void written(bool ok) {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (!stream_) return;
    if (!ok) end_ = grpc::Status(grpc::StatusCode::CANCELLED, "the caller gave up");
    if (end_) {
      finish();
    } else {
      pull();
    }
  }

  void end(const grpc::Status& status) {
    const std::lock_guard lock(mutex_);
    if (!stream_) return;
    end_ = status;
    if (!writing_) finish();
  }

 private:
  // These with mutex_ held.
  void pull() {
    pulling_ = true;
    again_ = false;
    const auto submitted = guarded([&]() -> Result<bool> {
      return threads_.submit([self = shared_from_this()] { self->run(); });
    });
    if (submitted && *submitted) return;
    pulling_ = false;
    end_ = to_grpc_status(submitted ? full_ : submitted.error());
    finish();
  }
  void finish() { std::exchange(stream_, nullptr)->Finish(*end_); }

  void run() {
    for (;;) {
      auto next = guarded([&]() -> Result<MessageSource::Next> {
        if (!source_) {
          auto made = make_(weak_from_this());
          if (!made) return made.error();
          source_ = std::move(*made);
        }
        return source_->next();
      });
      const std::lock_guard lock(mutex_);
      if (stream_ && next && !next->message && !next->end && std::exchange(again_, false)) continue;
      pulling_ = false;
      if (!stream_) return;
      if (!next || next->end) {
        end_ = next ? *next->end : to_grpc_status(next.error());
        return finish();
      }
      if (!next->message) return;
      writing_ = true;
      message_ = std::move(*next->message);
      return stream_->StartWrite(&message_);
    }
  }

  TaskThread& threads_;
  const Error full_;
  const Make make_;
  std::unique_ptr<MessageSource> source_;  // of the run in hand

  std::mutex mutex_;
  PulledStream* stream_;  // null: over
  bool pulling_ = false, writing_ = false;
  bool again_ = false;  // woken meanwhile
  std::optional<grpc::Status> end_;
  grpc::ByteBuffer message_;
};

PulledStream::PulledStream(TaskThread& threads, Error full, AccessControl& access, CallerPtr caller, Make make)
    : shared_(std::make_shared<Shared>(*this, threads, std::move(full), std::move(make))) {
  under_way_ = access.begin(std::move(caller), [weak = std::weak_ptr(shared_)](const grpc::Status& status) {
    if (const auto there = weak.lock()) there->end(status);
  });
  const auto shared = shared_;  // this may be gone once the first pull has failed
  shared->wake();
}

void PulledStream::OnWriteDone(bool ok) {
  const auto shared = shared_;
  shared->written(ok);
}

void PulledStream::OnCancel() {
  const auto shared = shared_;
  shared->end({grpc::StatusCode::CANCELLED, "the caller gave up"});
}

}  // namespace helio
