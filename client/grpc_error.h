// grpc::Status -> Error, in words that a person can act on.
#pragma once

#include <grpcpp/support/status.h>

#include <string>

#include "renderer/base/result.h"

namespace helio {

// Precondition: !status.ok(). `peer` names the daemon ("127.0.0.1:40123", "in process") where the failure is one of
// the connection; failures that the service reports itself keep the service's sentence. A deadline that passed becomes
// ErrorCode::unavailable: the daemon did not answer in time, or says for what it waited in vain.
Error to_error(const grpc::Status& status, const std::string& peer);

}  // namespace helio
