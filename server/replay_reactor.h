// ReplaySample: reads the token on gRPC's threads and leaves the tracing to the loader's, for paths may be long.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <memory>

#include "server/service_core.h"

namespace helio {

// Deletes itself when the call is over.
class ReplayReactor final : public grpc::ServerUnaryReactor {
 public:
  ReplayReactor(ServiceCore& core, const grpc::ByteBuffer& request, grpc::ByteBuffer* response);

  void OnCancel() override;
  void OnDone() override;

 private:
  struct Shared;  // with the task on the loader's thread

  Status start(grpc::ByteBuffer request);

  ServiceCore& core_;
  std::shared_ptr<Shared> shared_;
};

}  // namespace helio
