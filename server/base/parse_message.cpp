#include "server/base/parse_message.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/unknown_field_set.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>

namespace helio {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

// Message types do not nest in themselves, so their depth bounds the recursion. `path`: "" for the request itself.
void collect(const Message& message, const std::string& path, std::vector<std::string>& found) {
  const Reflection& reflection = *message.GetReflection();
  const auto& unknown = reflection.GetUnknownFields(message);
  for (int i = 0; i < unknown.field_count() && found.size() < kMaxUnknownFields; ++i) {
    std::string name = "field " + std::to_string(unknown.field(i).number()) + " of ";
    name += path.empty() ? std::string(message.GetDescriptor()->name()) : path;
    if (std::find(found.begin(), found.end(), name) == found.end()) found.push_back(std::move(name));
  }
  std::vector<const FieldDescriptor*> set;
  reflection.ListFields(message, &set);
  for (const FieldDescriptor* field : set) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    const std::string inner = (path.empty() ? "" : path + ".") + std::string(field->name());
    if (!field->is_repeated()) {
      collect(reflection.GetMessage(message, field), inner, found);
    } else {
      for (int i = 0; i < reflection.FieldSize(message, field) && found.size() < kMaxUnknownFields; ++i) {
        collect(reflection.GetRepeatedMessage(message, field, i), inner, found);
      }
    }
  }
}

}  // namespace

Status parse_message(grpc::ByteBuffer& bytes, Message& message) {
  message.Clear();
  if (bytes.Valid()) {
    grpc::ProtoBufferReader reader(&bytes);
    if (message.ParseFromZeroCopyStream(&reader)) return ok_status();
  }
  return Error{ErrorCode::invalid_argument,
               "not a well-formed " + std::string(message.GetDescriptor()->full_name()) +
                   " (or text that is not UTF-8)",
               {}};
}

std::vector<std::string> unknown_fields(const Message& message) {
  std::vector<std::string> found;
  collect(message, "", found);
  return found;
}

void tell_ignored(grpc::CallbackServerContext& context, const std::vector<std::string>& fields) {
  if (!fields.empty()) context.AddTrailingMetadata(kIgnoredFieldsKey, join_fields(fields));
}

std::string join_fields(const std::vector<std::string>& fields) {
  std::string all;
  for (const std::string& field : fields) all += (all.empty() ? "" : ", ") + field;
  return all;
}

}  // namespace helio
