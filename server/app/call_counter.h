// Counts calls as they end, whoever ends them: in gRPC's own place for that, an interceptor of each call.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include "server/metrics/rpc_counts.h"

namespace helio {

// Of RenderService's methods, health and reflection.
RpcCounts counts_of_service();

class CallCounter final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit CallCounter(RpcCounts& counts) : counts_(counts) {}  // which outlive the server
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* call) override;

 private:
  RpcCounts& counts_;
};

}  // namespace helio
