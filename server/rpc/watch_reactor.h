// WatchFrames: what StreamFrames would send, for clients without bidirectional streams.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <memory>
#include <string>

#include "server/base/grpc_status.h"
#include "server/sessions/service_core.h"
#include "server/stream/outbound_stream.h"

namespace helio {

// Deletes itself when the call is over.
class WatchReactor final : public grpc::ServerWriteReactor<grpc::ByteBuffer>, private OutboundStream::Call {
 public:
  WatchReactor(ServiceCore& core, CallerPtr caller, const grpc::ByteBuffer& request);

  void OnWriteDone(bool ok) override { stream_->write_done(ok); }
  void OnCancel() override;
  void OnDone() override;

 private:
  void start_write(const grpc::ByteBuffer* message) override { StartWrite(message); }
  void finish(const grpc::Status& status) override { Finish(copy_status(status)); }
  Status start(grpc::ByteBuffer request, ServiceCore& core);

  const CallerPtr caller_;
  std::string session_id_;
  std::shared_ptr<Session> session_;
  std::shared_ptr<OutboundStream> stream_;
  std::unique_ptr<AccessControl::Call> under_way_;
};

}  // namespace helio
