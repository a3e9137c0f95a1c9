#include "server/web/envelope.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>

#include <vector>

#include "heliograph/v1/web.pb.h"

namespace helio {
namespace {

namespace pb = heliograph::v1;
using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;

// https://protobuf.dev/programming-guides/encoding, "Message Structure".
enum WireType : std::uint32_t { kVarint = 0, kFixed64 = 1, kLengthDelimited = 2, kFixed32 = 5 };
constexpr int kIdField = pb::WebResponse::kIdFieldNumber;

std::string camel_case(std::string_view snake) {
  std::string camel;
  bool upper = true;
  for (const char c : snake) {
    if (c == '_') {
      upper = true;
      continue;
    }
    camel += upper && c >= 'a' && c <= 'z' ? char(c - 'a' + 'A') : c;
    upper = false;
  }
  return camel;
}

std::vector<WebCall> make_calls() {
  const auto& request = *pb::WebRequest::descriptor();
  const auto* service = request.file()->pool()->FindServiceByName("heliograph.v1.RenderService");
  std::vector<WebCall> calls;
  for (int i = 0; service && i < request.field_count(); ++i) {
    const auto* method = service->FindMethodByName(camel_case(std::string(request.field(i)->name())));
    if (!method) continue;
    calls.push_back({request.field(i)->number(),
                     "/" + std::string(service->full_name()) + "/" + std::string(method->name()),
                     method->client_streaming()});
  }
  return calls;
}

Error malformed() {
  return {ErrorCode::invalid_argument, "not a well-formed heliograph.v1.WebRequest", {}};
}

}  // namespace

const WebCall* find_web_call(int field) {
  static const std::vector<WebCall> calls = make_calls();
  for (const WebCall& call : calls) {
    if (call.field == field) return &call;
  }
  return nullptr;
}

Result<Envelope> read_envelope(std::span<const std::uint8_t> message) {
  Envelope envelope;
  CodedInputStream in(message.data(), int(message.size()));
  while (const std::uint32_t tag = in.ReadTag()) {
    const int field = int(tag >> 3);
    std::uint64_t number = 0;
    std::uint32_t small = 0;
    switch (tag & 7) {
      case kVarint:
        if (!in.ReadVarint64(&number)) return malformed();
        if (field == kIdField) envelope.id = number;
        break;
      case kFixed64:
        if (!in.ReadLittleEndian64(&number)) return malformed();
        break;
      case kFixed32:
        if (!in.ReadLittleEndian32(&small)) return malformed();
        break;
      case kLengthDelimited: {
        if (!in.ReadVarint32(&small)) return malformed();
        const std::size_t begin = std::size_t(in.CurrentPosition());
        if (small > message.size() - begin || !in.Skip(int(small))) return malformed();
        envelope.field = field;
        envelope.content = message.subspan(begin, small);
        break;
      }
      default:
        return malformed();
    }
  }
  if (!in.ConsumedEntireMessage()) return malformed();
  if (envelope.id > kMaxCallId) {
    return Error{ErrorCode::invalid_argument, "above 2^53 - 1; allowed: [1, 2^53)", "id"};
  }
  return envelope;
}

std::string envelope_head(std::uint64_t id, int field, std::size_t content_bytes) {
  std::uint8_t bytes[32];
  std::uint8_t* end = bytes;
  if (id != 0) {
    end = CodedOutputStream::WriteTagToArray(std::uint32_t(kIdField) << 3 | kVarint, end);
    end = CodedOutputStream::WriteVarint64ToArray(id, end);
  }
  end = CodedOutputStream::WriteTagToArray(std::uint32_t(field) << 3 | kLengthDelimited, end);
  end = CodedOutputStream::WriteVarint32ToArray(std::uint32_t(content_bytes), end);
  return {reinterpret_cast<const char*>(bytes), std::size_t(end - bytes)};
}

}  // namespace helio
