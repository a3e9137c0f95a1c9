// Parsing that refuses what protobuf would silently accept.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

#include "renderer/base/result.h"

namespace helio {

// Reads one message. invalid_argument, listing every finding, when the bytes are not such a message, carry a field that
// this daemon does not know, give a field twice (protobuf would merge two views into one) or several members of a
// oneof.
Status parse_message(grpc::ByteBuffer& bytes, google::protobuf::Message& message);

}  // namespace helio
