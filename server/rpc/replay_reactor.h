// ReplaySample: reads the token on gRPC's threads and leaves the tracing to the replayer's, for paths may be long.
#pragma once

#include "server/rpc/unary_call.h"
#include "server/sessions/service_core.h"

namespace helio {

class ReplayReactor final : public UnaryCall {
 public:
  ReplayReactor(ServiceCore& core, grpc::CallbackServerContext& context, const grpc::ByteBuffer& request,
                grpc::ByteBuffer* response);

 private:
  Status start(grpc::CallbackServerContext& context, grpc::ByteBuffer request);

  ServiceCore& core_;
};

}  // namespace helio
