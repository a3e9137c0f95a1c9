// A client-streaming call whose answer is worked out by a task on another thread.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <algorithm>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/base/grpc_status.h"
#include "server/base/guarded.h"
#include "server/base/parse_message.h"
#include "server/stream/stream_messages.h"

namespace helio {

// The one place that finishes the call. A task that outlasts its call finds no reactor any more. Thread safe.
template <class Response>
class UploadCall {
 public:
  UploadCall(grpc::ServerReadReactor<grpc::ByteBuffer>& reactor, grpc::CallbackServerContext& context,
             grpc::ByteBuffer& response)
      : reactor_(&reactor), context_(context), response_(response) {}

  // Fields of the request that this daemon does not know: the caller is told when the call ends.
  void ignore(std::vector<std::string> fields) {
    const std::lock_guard lock(mutex_);
    for (std::string& field : fields) {
      const bool known = std::find(ignored_.begin(), ignored_.end(), field) != ignored_.end();
      if (!known && ignored_.size() < kMaxUnknownFields) ignored_.push_back(std::move(field));
    }
  }
  bool over() {
    const std::lock_guard lock(mutex_);
    return !reactor_;
  }
  // The first end counts.
  void finish(const grpc::Status& status, const Response* answer = nullptr) {
    const std::lock_guard lock(mutex_);
    if (!reactor_) return;
    const Status told = guarded([&] {
      if (answer) response_ = to_bytes(*answer);
      tell_ignored(context_, ignored_);
      return ok_status();
    });
    std::exchange(reactor_, nullptr)->Finish(told.ok() ? copy_status(status) : to_grpc_status(told));
  }
  void finish(const Result<Response>& answer) {
    if (answer) {
      finish(grpc::Status::OK, &*answer);
    } else {
      finish(to_grpc_status(answer.error()));
    }
  }

 private:
  std::mutex mutex_;
  grpc::ServerReadReactor<grpc::ByteBuffer>* reactor_;  // null: finished, and the two below are gone
  grpc::CallbackServerContext& context_;
  grpc::ByteBuffer& response_;
  std::vector<std::string> ignored_;
};

}  // namespace helio
