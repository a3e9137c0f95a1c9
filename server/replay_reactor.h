// ReplaySample: reads the token on gRPC's threads and leaves the tracing to the replayer's, for paths may be long.
#pragma once

#include "server/service_core.h"
#include "server/unary_call.h"

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
