// RunJob: one still or the views of a path, from accepted to result.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <string>

#include "server/rpc/call_hold.h"
#include "server/sessions/service_core.h"
#include "server/stream/outbound_stream.h"

namespace helio {

// A job that ends by itself has left the store before its call ends, so that whoever is told of the end may have its
// place. The reactor deletes itself when the call is over.
class JobReactor final : public grpc::ServerWriteReactor<grpc::ByteBuffer>, private OutboundStream::Call {
 public:
  JobReactor(ServiceCore& core, CallerPtr caller, grpc::CallbackServerContext& context,
             const grpc::ByteBuffer& request);

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  void start_write(const grpc::ByteBuffer* message) override { StartWrite(message); }
  void finish(const grpc::Status& status) override {
    if (!hold_.defer(status)) Finish(copy_status(status));
  }
  void start_later(grpc::CallbackServerContext& context, const grpc::ByteBuffer& request);
  void start_over();
  Status start(grpc::CallbackServerContext& context, const pb::RunJobRequest& request);
  std::shared_ptr<Job> job();  // null: not yet, or released
  void release_job();
  grpc::ByteBuffer encode(Outbound message);  // the stream calls it for one message at a time

  ServiceCore& core_;
  const CallerPtr caller_;
  CallHold hold_;  // while it starts
  std::string job_id_;  // empty: none was reserved
  std::mutex job_mutex_;  // of the two below
  std::shared_ptr<Job> job_;
  bool cancelled_ = false;
  std::shared_ptr<OutboundStream> stream_;
  std::unique_ptr<AccessControl::Call> under_way_;
  std::uint32_t views_done_ = 0;  // encode()'s alone
  bool result_sent_ = false;      // encode()'s alone
  std::atomic<bool> view_due_ = false, end_due_ = false;
  const double began_s_;                                              // now_s()
  std::atomic<FrameEndReason> reason_{FrameEndReason::cancelled};  // of its end
};

}  // namespace helio
