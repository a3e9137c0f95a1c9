// Lets another thread (a Ctrl-C handler, a user interface) cancel a call that is under way.
#pragma once

#include <grpcpp/client_context.h>

#include <mutex>

namespace helio {

// Thread safe. One control may serve several calls, one after the other; once cancelled, later calls end at once too.
class CallControl {
 public:
  void cancel() {
    std::lock_guard lock(mutex_);
    cancelled_ = true;
    if (context_) context_->TryCancel();
  }

  bool cancelled() const {
    std::lock_guard lock(mutex_);
    return cancelled_;
  }

  // Binds a call for the length of a scope. `control` may be null.
  class Scope {
   public:
    Scope(CallControl* control, grpc::ClientContext& context) : control_(control) {
      if (!control_) return;
      std::lock_guard lock(control_->mutex_);
      control_->context_ = &context;
      if (control_->cancelled_) context.TryCancel();
    }
    ~Scope() {
      if (!control_) return;
      std::lock_guard lock(control_->mutex_);
      control_->context_ = nullptr;
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    CallControl* control_;
  };

 private:
  mutable std::mutex mutex_;
  grpc::ClientContext* context_ = nullptr;
  bool cancelled_ = false;
};

}  // namespace helio
