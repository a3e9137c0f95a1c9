// Keeps a streaming call from finishing while a task on another thread uses its reactor: a reactor may be gone as soon
// as its call is finished.
#pragma once

#include <grpcpp/support/status.h>

#include <mutex>
#include <optional>
#include <utility>

#include "server/base/grpc_status.h"

namespace helio {

class CallHold {
 public:
  // One task at a time. False: the call is finished already, nothing may use its reactor later on.
  [[nodiscard]] bool begin() {
    const std::lock_guard lock(mutex_);
    held_ = !finished_;
    return held_;
  }
  // True: the call is finished by end(). False: the caller finishes it, now.
  bool defer(const grpc::Status& status) noexcept {
    const std::lock_guard lock(mutex_);
    finished_ = true;
    if (held_) status_ = copy_status(status);
    return held_;
  }
  // The task is over. Gives the status to finish the call with, if that was asked for meanwhile; else calls `go_on`,
  // before any finish.
  template <class GoOn>
  std::optional<grpc::Status> end(const GoOn& go_on) {
    const std::lock_guard lock(mutex_);
    held_ = false;
    if (!status_) go_on();
    return std::exchange(status_, std::nullopt);
  }
  // Returns when nobody is in a function above any more; for the reactor's end.
  void wait() { const std::lock_guard lock(mutex_); }

 private:
  std::mutex mutex_;
  bool held_ = false, finished_ = false;
  std::optional<grpc::Status> status_;
};

}  // namespace helio
