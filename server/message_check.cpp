#include "server/message_check.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>
#include <set>
#include <string>

namespace helio {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::OneofDescriptor;
using google::protobuf::internal::WireFormat;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

constexpr std::size_t kMaxFindings = 16;

class WireCheck {
 public:
  explicit WireCheck(Problems& problems) : problems_(problems) {}

  // False: the bytes are not well formed. Message types do not nest in themselves, so their depth bounds the recursion.
  bool message(CodedInputStream& in, const Descriptor& type, const std::string& where) {
    std::set<int> fields;
    std::set<const OneofDescriptor*> oneofs;
    while (const std::uint32_t tag = in.ReadTag()) {
      const int number = WireFormatLite::GetTagFieldNumber(tag);
      const FieldDescriptor* field = type.FindFieldByNumber(number);
      if (!field) {
        find(where, "field number " + std::to_string(number) + " is not known to this daemon");
        if (!WireFormatLite::SkipField(&in, tag)) return false;
        continue;
      }
      const std::string path = where.empty() ? field->name() : where + "." + field->name();
      if (WireFormatLite::GetTagWireType(tag) != WireFormat::WireTypeForField(field)) return false;
      if (!field->is_repeated() && !fields.insert(number).second) {
        find(path, "given more than once; allowed: once per message");
      } else if (const OneofDescriptor* oneof = field->real_containing_oneof(); oneof && !oneofs.insert(oneof).second) {
        find(path, "given beside another member of \"" + oneof->name() + "\"; allowed: one of them");
      }
      if (field->type() == FieldDescriptor::TYPE_MESSAGE) {
        std::uint32_t length = 0;
        if (!in.ReadVarint32(&length)) return false;
        const CodedInputStream::Limit limit = in.PushLimit(static_cast<int>(length));
        if (!message(in, *field->message_type(), path) || in.BytesUntilLimit() != 0) return false;
        in.PopLimit(limit);
      } else if (!WireFormatLite::SkipField(&in, tag)) {
        return false;
      }
    }
    return in.ConsumedEntireMessage();
  }

 private:
  void find(const std::string& where, std::string what) {
    if (problems_.size() < kMaxFindings) problems_.add(where, std::move(what));
  }

  Problems& problems_;
};

}  // namespace

Status parse_message(grpc::ByteBuffer& bytes, google::protobuf::Message& message) {
  Problems problems;
  bool well_formed = true;
  if (bytes.Valid() && bytes.Length() > 0) {
    grpc::ProtoBufferReader reader(&bytes);
    CodedInputStream in(&reader);
    well_formed = WireCheck(problems).message(in, *message.GetDescriptor(), "");
  }
  if (!problems.empty()) return problems.to_error();
  if (well_formed && bytes.Valid()) {
    grpc::ProtoBufferReader reader(&bytes);
    well_formed = message.ParseFromZeroCopyStream(&reader);
  }
  if (!well_formed) {
    return Error{ErrorCode::invalid_argument,
                 "not a well-formed " + message.GetDescriptor()->full_name() + " (or text that is not UTF-8)",
                 {}};
  }
  return ok_status();
}

}  // namespace helio
