// StreamFrames: one read and one write in flight; the call is finished by its OutboundStream alone.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/rpc/call_hold.h"
#include "server/rpc/read_deadline.h"
#include "server/sessions/service_core.h"
#include "server/stream/outbound_stream.h"

namespace helio {

// Deletes itself when the call is over.
class FrameStreamReactor final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                                 private OutboundStream::Call {
 public:
  FrameStreamReactor(ServiceCore& core, CallerPtr caller);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override { stream_->write_done(ok); }
  void OnCancel() override;
  void OnDone() override;

 private:
  void start_write(const grpc::ByteBuffer* message) override { StartWrite(message); }
  void finish(const grpc::Status& status) override {
    if (!hold_.defer(status)) Finish(copy_status(status));
  }

  // The thread for a request that takes long, as one that may allocate a film or place a scene. Null: it is handled at
  // once.
  TaskThread* thread_for(const pb::StreamRequest& request) const;
  // Runs handle() on `thread`.
  void handle_later(TaskThread& thread, std::shared_ptr<const pb::StreamRequest> request);
  // False: the stream ends, nothing more is read.
  bool handle(const pb::StreamRequest& request);
  Status open(const pb::StreamRequest::Open& open);
  void end(const grpc::Status& status);
  void leave_session();
  // Remembers and, once the stream is open, tells the client which of its fields are ignored.
  void note_unknown(const pb::StreamRequest& request);
  void tell_ignored();
  std::shared_ptr<Session> session() const;

  ServiceCore& core_;
  const CallerPtr caller_;
  std::string session_id_;  // set before anything is sent
  grpc::ByteBuffer request_;
  std::shared_ptr<OutboundStream> stream_;
  std::unique_ptr<AccessControl::Call> under_way_;
  std::unique_ptr<ReadDeadline> open_due_;
  OpenCalls::Place unopened_;  // a drain ends an opened stream by its session
  CallHold hold_;
  // Fields that this daemon does not know. One request is handled at a time, and nothing is read until it is.
  std::vector<std::string> ignored_;
  bool ignored_is_told_ = true;

  mutable std::mutex mutex_;
  std::shared_ptr<Session> session_;
};

}  // namespace helio
