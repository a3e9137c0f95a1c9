// A server stream whose messages are made one after another on threads that may wait for the disk: the next is asked for
// when the one before is on its way, so a slow client holds one message.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <optional>

#include "renderer/base/result.h"
#include "server/base/access_control.h"
#include "server/base/task_thread.h"

namespace helio {

// Where the messages come from. One call at a time.
class MessageSource {
 public:
  virtual ~MessageSource() = default;
  // At most one of them; neither: nothing is there yet, and the stream is to be woken when there may be.
  struct Next {
    std::optional<grpc::ByteBuffer> message;
    std::optional<grpc::Status> end;  // of the call
  };
  virtual Result<Next> next() = 0;  // an error ends the call
};

// Deletes itself when the call is over.
class PulledStream final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  // What wakes the stream may outlive it.
  class Waker {
   public:
    virtual ~Waker() = default;
    virtual void wake() = 0;  // thread safe; returns at once
  };
  // `make` is called once, with what wakes the stream, on one of the threads; its error ends the call. `full`: the
  // answer where the threads have no place.
  using Make = std::function<Result<std::unique_ptr<MessageSource>>(std::weak_ptr<Waker> waker)>;
  PulledStream(TaskThread& threads, Error full, AccessControl& access, CallerPtr caller, Make make);

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override { delete this; }

 private:
  class Shared;
  std::shared_ptr<Shared> shared_;
  std::unique_ptr<AccessControl::Call> under_way_;
};

}  // namespace helio
