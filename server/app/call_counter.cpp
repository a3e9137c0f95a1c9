#include "server/app/call_counter.h"

#include <string>
#include <utility>
#include <vector>

#include "server/rpc/render_service.h"

namespace helio {
namespace {

class CountedCall final : public grpc::experimental::Interceptor {
 public:
  CountedCall(RpcCounts& counts, std::size_t method) : counts_(counts), method_(method) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(grpc::experimental::InterceptionHookPoints::PRE_SEND_STATUS))
      counts_.count(method_, methods->GetSendStatus().error_code());
    methods->Proceed();
  }

 private:
  RpcCounts& counts_;
  const std::size_t method_;
};

}  // namespace

RpcCounts counts_of_service() {
  std::vector<std::string> methods = {"Check", "Watch", "ServerReflectionInfo"};
  const auto* service = heliograph::v1::GetServerInfoRequest::descriptor()->file()->service(0);
  for (int i = 0; i < service->method_count(); ++i) methods.emplace_back(service->method(i)->name());
  return RpcCounts(std::move(methods));
}

grpc::experimental::Interceptor* CallCounter::CreateServerInterceptor(grpc::experimental::ServerRpcInfo* call) {
  return new CountedCall(counts_, counts_.method_of(call->method()));
}

}  // namespace helio
