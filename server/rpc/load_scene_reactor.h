// LoadScene: collects the request on gRPC's threads and leaves the load to the loader's.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <memory>
#include <optional>

#include "server/rpc/read_deadline.h"
#include "server/sessions/service_core.h"

namespace helio {

// Deletes itself when the call is over.
class LoadSceneReactor final : public grpc::ServerReadReactor<grpc::ByteBuffer> {
 public:
  LoadSceneReactor(ServiceCore& core, CallerPtr caller, grpc::CallbackServerContext& context,
                   grpc::ByteBuffer* response);

  void OnReadDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  struct Shared;  // with the load on the loader's thread

  void read();
  Status handle(const pb::LoadSceneRequest& request);
  Status begin(const pb::LoadSceneRequest::Begin& begin);
  Status submit();

  ServiceCore& core_;
  const CallerPtr caller_;
  grpc::ByteBuffer request_;
  std::optional<SceneRequest> load_;  // begin has been received
  std::optional<BundleReceiver> upload_;
  std::shared_ptr<Shared> shared_;
  std::unique_ptr<AccessControl::Call> under_way_;
  std::unique_ptr<ReadDeadline> message_due_;
};

}  // namespace helio
