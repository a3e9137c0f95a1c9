// The one place where an Error becomes what a caller sees.
#pragma once

#include <grpcpp/support/status.h>

#include "renderer/base/result.h"

namespace helio {

// The message is cut at kMaxStatusMessage bytes: status travels in HTTP/2 trailers, which clients hold to 8 KiB.
inline constexpr std::size_t kMaxStatusMessage = 2000;

// Error::retry_after_s is told in the message and, for programs, as google.rpc.RetryInfo in the status' details.
grpc::Status to_grpc_status(const Error& error);
inline grpc::Status to_grpc_status(const Status& status) {
  return status.ok() ? grpc::Status::OK : to_grpc_status(status.error());
}

}  // namespace helio
