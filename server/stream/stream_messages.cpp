#include "server/stream/stream_messages.h"

#include <google/protobuf/io/coded_stream.h>
#include <grpcpp/support/slice.h>

#include "server/base/build_info.h"
#include "server/base/parse_message.h"
#include "server/stream/convert.h"
#include "server/stream/owned_message.h"

namespace helio {
namespace {

using google::protobuf::io::CodedOutputStream;

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

// Appends the head of a length-delimited field (wire type 2): its tag and the length of what follows.
void append_head(std::string& out, int field_number, std::size_t length) {
  std::uint8_t head[20];
  std::uint8_t* end = CodedOutputStream::WriteTagToArray(std::uint32_t(field_number) << 3 | 2, head);
  end = CodedOutputStream::WriteVarint64ToArray(length, end);
  out.append(reinterpret_cast<const char*>(head), end - head);
}

// The message { tile: Tile } whose member `tile` has this field number: a slice with all but the EXR or JPEG, then that
// file, which is the last field of the last field and so needs nothing behind it.
grpc::ByteBuffer tile_message(EncodedTile tile, int tile_field, const std::string& session_id) {
  const std::string meta = to_message(tile, session_id).SerializeAsString();
  std::string file_head;
  append_head(file_head, tile.jpeg ? pb::Tile::kJpegFieldNumber : pb::Tile::kExrFieldNumber, tile.bytes.size());
  std::string head;
  append_head(head, tile_field, meta.size() + file_head.size() + tile.bytes.size());
  head += meta;
  head += file_head;

  auto* file = new std::vector<std::uint8_t>(std::move(tile.bytes));
  const grpc::Slice slices[] = {grpc::Slice(head),
                                grpc::Slice(
                                    file->data(), file->size(),
                                    [](void* owner) { delete static_cast<std::vector<std::uint8_t>*>(owner); }, file)};
  return grpc::ByteBuffer(slices, 2);
}

grpc::ByteBuffer raw(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

}  // namespace

grpc::ByteBuffer to_bytes(const google::protobuf::MessageLite& message) {
  return raw(message.SerializeAsString());
}

Notice ignored_fields_notice(const std::vector<std::string>& fields) {
  return {NoticeSeverity::warning, std::string("this daemon (version ") + build_version() +
                                       ") does not know and ignores " + join_fields(fields)};
}

grpc::ByteBuffer to_stream_response(Outbound message, const std::string& session_id) {
  pb::StreamResponse response;
  return std::visit(Overloaded{[](Greeting& greeting) { return raw(greeting.message); },
                               [&](Notice& notice) {
                                 response.set_allocated_notice(owned_message(to_message(notice)));
                                 return to_bytes(response);
                               },
                               [&](FrameBegin& begin) {
                                 response.set_allocated_frame_begin(owned_message(to_message(begin, session_id)));
                                 return to_bytes(response);
                               },
                               [&](FrameProgress& progress) {
                                 response.set_allocated_progress(owned_message(to_message(progress, session_id)));
                                 return to_bytes(response);
                               },
                               [&](EncodedTile& tile) {
                                 return tile_message(std::move(tile), pb::StreamResponse::kTileFieldNumber, session_id);
                               },
                               [&](FrameReport& report) {
                                 response.set_allocated_frame_end(owned_message(to_message(report, session_id)));
                                 return to_bytes(response);
                               }},
                    message);
}

grpc::ByteBuffer to_job_response(Outbound message) {
  const std::string no_session;
  pb::RunJobResponse response;
  return std::visit(
      Overloaded{[](Greeting& greeting) { return raw(greeting.message); }, [](Notice&) { return grpc::ByteBuffer(); },
                 [](FrameBegin&) { return grpc::ByteBuffer(); },
                 [&](FrameProgress& progress) {
                   response.set_allocated_progress(owned_message(to_message(progress, no_session)));
                   return to_bytes(response);
                 },
                 [&](EncodedTile& tile) {
                   return tile_message(std::move(tile), pb::RunJobResponse::kTileFieldNumber, no_session);
                 },
                 [](FrameReport&) { return grpc::ByteBuffer(); }},
      message);
}

grpc::ByteBuffer to_job_result(const FrameReport& report, const std::string& job_id, std::uint32_t view, bool over,
                               std::uint64_t invalid_samples) {
  pb::RunJobResponse response;
  const auto filled = [&](auto result) {
    result.set_job_id(job_id);
    result.set_view(view);
    *result.mutable_end() = to_message(report, "");
    return owned_message(std::move(result));
  };
  if (over) {
    response.set_allocated_result(filled(pb::RunJobResponse::Result()));
    response.mutable_result()->set_invalid_samples(invalid_samples);
  } else {
    response.set_allocated_view_result(filled(pb::RunJobResponse::ViewResult()));
  }
  return to_bytes(response);
}

}  // namespace helio
