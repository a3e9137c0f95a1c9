// Reading requests: protobuf's own rules, and the names of the fields that this daemon does not know.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <string>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

// invalid_argument when the bytes are not such a message. Fields that this daemon does not know do not make it so.
Status parse_message(grpc::ByteBuffer& bytes, google::protobuf::Message& message);

// The most fields that unknown_fields() names.
inline constexpr std::size_t kMaxUnknownFields = 16;

// The fields in `message`, and in the messages that it holds, that this daemon does not know (a newer client set them):
// "field 17 of view.camera", or "field 17 of StreamRequest" for one of the message itself. Each once.
std::vector<std::string> unknown_fields(const google::protobuf::Message& message);

// Names them in the call's trailing metadata; for calls that have no notices. Not beside or after Finish().
void tell_ignored(grpc::CallbackServerContext& context, const std::vector<std::string>& fields);
inline constexpr char kIgnoredFieldsKey[] = "heliograph-ignored-fields";  // its value is join_fields()

std::string join_fields(const std::vector<std::string>& fields);  // separated by ", "

}  // namespace helio
