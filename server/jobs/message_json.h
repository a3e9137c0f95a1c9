// A message as JSON, by protobuf's own rules, with the names of its .proto file.
#pragma once

#include <google/protobuf/message.h>

#include <string>

#include "renderer/base/result.h"

namespace helio {

// internal for bytes that are no text in a text field. Throws std::bad_alloc, as util::MessageToJsonString() does not
// always: within that, one that strikes while its text grows ends the process.
Result<std::string> to_json(const google::protobuf::Message& message);

}  // namespace helio
