// The one place where an Error becomes what a caller sees.
#pragma once

#include <grpcpp/support/status.h>

#include "renderer/base/result.h"

namespace helio {

// The message is cut at kMaxStatusMessage bytes: status travels in HTTP/2 trailers, which clients hold to 8 KiB.
inline constexpr std::size_t kMaxStatusMessage = 2000;

// Error::retry_after_s is told in the message and, for programs, as google.rpc.RetryInfo in the status' details.
grpc::Status to_grpc_status(const Error& error) noexcept;
inline grpc::Status to_grpc_status(const Status& status) noexcept {
  return status.ok() ? grpc::Status::OK : to_grpc_status(status.error());
}

// Without its text where there is no memory for that: a status that is lost would leave the call open for ever.
grpc::Status copy_status(const grpc::Status& status) noexcept;
// RESOURCE_EXHAUSTED in a text that a string holds without an allocation.
grpc::Status out_of_memory() noexcept;

}  // namespace helio
