// RunJob: one still, from accepted to result.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <memory>
#include <string>

#include "server/outbound_stream.h"
#include "server/service_core.h"

namespace helio {

// Deletes itself when the call is over, and the job with it.
class JobReactor final : public grpc::ServerWriteReactor<grpc::ByteBuffer>, private OutboundStream::Call {
 public:
  JobReactor(ServiceCore& core, const grpc::ByteBuffer& request);

  void OnWriteDone(bool ok) override { stream_->write_done(ok); }
  void OnCancel() override;
  void OnDone() override;

 private:
  void start_write(const grpc::ByteBuffer* message) override { StartWrite(message); }
  void finish(const grpc::Status& status) override { Finish(status); }
  Status start(grpc::ByteBuffer request);

  ServiceCore& core_;
  std::string job_id_;  // empty: none was reserved
  std::shared_ptr<Job> job_;
  std::shared_ptr<OutboundStream> stream_;
};

}  // namespace helio
