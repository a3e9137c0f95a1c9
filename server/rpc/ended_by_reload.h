// How calls end whose token went out of force: what AccessControl::begin() is given for them.
#pragma once

#include <grpcpp/support/status.h>

#include <functional>
#include <memory>

#include "server/stream/outbound_stream.h"

namespace helio {

// Ends the call of this stream, if it is still there.
inline std::function<void(const grpc::Status&)> end_of(const std::shared_ptr<OutboundStream>& stream) {
  return [weak = std::weak_ptr(stream)](const grpc::Status& status) {
    if (const auto there = weak.lock()) there->finish(status);
  };
}

}  // namespace helio
