// LoadReference: collects the file on gRPC's threads and leaves its reading to those of films.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "server/compare/compare_core.h"
#include "server/rpc/read_deadline.h"
#include "server/rpc/upload_call.h"

namespace helio {

// Deletes itself when the call is over.
class LoadReferenceReactor final : public grpc::ServerReadReactor<grpc::ByteBuffer> {
 public:
  LoadReferenceReactor(CompareCore& compare, CallerPtr caller, grpc::CallbackServerContext& context,
                       grpc::ByteBuffer* response);

  void OnReadDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override { delete this; }

 private:
  using Call = UploadCall<pb::LoadReferenceResponse>;  // with the task that reads the file
  struct Upload;

  void read();
  Status handle(const pb::LoadReferenceRequest& request);
  Status begin(const pb::LoadReferenceRequest::Begin& begin);
  Status submit();

  CompareCore& compare_;
  const CallerPtr caller_;
  grpc::ByteBuffer request_;
  std::shared_ptr<Upload> upload_;  // null: begin has not come
  std::shared_ptr<Call> call_;
  OpenCalls::Place place_;
  std::unique_ptr<AccessControl::Call> under_way_;
  std::unique_ptr<ReadDeadline> message_due_;
};

}  // namespace helio
