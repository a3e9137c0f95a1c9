// EditScene: reads the request on gRPC's threads and leaves the edit to the loader's, for what is moved may take a
// while to build.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <memory>

#include "server/service_core.h"

namespace helio {

// Deletes itself when the call is over.
class EditSceneReactor final : public grpc::ServerUnaryReactor {
 public:
  EditSceneReactor(ServiceCore& core, const grpc::ByteBuffer& request, grpc::ByteBuffer* response);

  void OnCancel() override;
  void OnDone() override;

 private:
  struct Shared;  // with the task on the loader's thread

  Status start(grpc::ByteBuffer request);

  ServiceCore& core_;
  std::shared_ptr<Shared> shared_;
};

}  // namespace helio
