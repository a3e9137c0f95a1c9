// EditScene: reads the request on gRPC's threads and leaves the edit to the editor's, for what is moved may take a
// while to build.
#pragma once

#include "server/rpc/unary_call.h"
#include "server/sessions/service_core.h"

namespace helio {

class EditSceneReactor final : public UnaryCall {
 public:
  EditSceneReactor(ServiceCore& core, CallerPtr caller, grpc::CallbackServerContext& context,
                   const grpc::ByteBuffer& request, grpc::ByteBuffer* response);

 private:
  Status start(grpc::CallbackServerContext& context, grpc::ByteBuffer request);

  ServiceCore& core_;
  const CallerPtr caller_;
};

}  // namespace helio
