// Compare: reads the request on gRPC's threads and leaves the comparison to its queue's.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <memory>

#include "server/compare/compare_core.h"

namespace helio {

// Deletes itself when the call is over.
class CompareReactor final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  CompareReactor(CompareCore& compare, CallerPtr caller, grpc::CallbackServerContext& context,
                 const grpc::ByteBuffer& request);

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  class Call;  // with the comparison

  Status start(CompareCore& compare, const Caller& caller, grpc::CallbackServerContext& context,
               const grpc::ByteBuffer& request);

  CompareCore& compare_;
  std::shared_ptr<Call> call_;
  std::unique_ptr<AccessControl::Call> under_way_;
};

}  // namespace helio
