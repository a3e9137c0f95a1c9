// A unary call that a task on another thread answers.
#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <mutex>

#include "renderer/base/cancel.h"
#include "renderer/base/result.h"
#include "server/sessions/service_core.h"

namespace helio {

// Ends once: by the task, by the caller who gives up, or by an error before there is a task. Deletes itself then.
class UnaryCall : public grpc::ServerUnaryReactor {
 public:
  void OnCancel() final;
  void OnDone() final { delete this; }

 protected:
  // What the task holds of the call, which may be over before it. Thread safe.
  class Outcome {
   public:
    Outcome(UnaryCall& call, grpc::ByteBuffer& response) : call_(&call), response_(response) {}

    void finish(const google::protobuf::MessageLite& answer);
    void fail(const grpc::Status& status);
    CancelToken cancel;
    OpenCalls::Place place;  // of end_by_drain()

   private:
    std::mutex mutex_;
    UnaryCall* call_;  // null: over
    grpc::ByteBuffer& response_;
  };

  explicit UnaryCall(grpc::ByteBuffer* response);

  // Calls `start`, which hands outcome() to a task; its error ends the call. This may be gone afterwards.
  void begin(const std::function<Status()>& start);
  const std::shared_ptr<Outcome>& outcome() const { return outcome_; }
  // A drain cancels the task and ends the call, whose answer nobody could use any more. Before the task is there.
  void end_by_drain(ServiceCore& core);

 private:
  std::shared_ptr<Outcome> outcome_;
};

}  // namespace helio
