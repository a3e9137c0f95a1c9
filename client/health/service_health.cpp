#include "client/health/service_health.h"

#include <google/protobuf/io/coded_stream.h>
#include <grpcpp/generic/generic_stub.h>

#include <cstdint>
#include <optional>

namespace helio {
namespace {

// HealthCheckRequest { string service = 1; } and HealthCheckResponse { ServingStatus status = 1; } of
// grpc/health/v1/health.proto. gRPC's server has them built in, and no package gives clients their classes.
constexpr char kServiceTag = 1 << 3 | 2, kStatusTag = 1 << 3;
constexpr std::uint32_t kServing = 1;

std::string request_bytes(const std::string& service) {
  std::string bytes;
  if (service.empty()) return bytes;
  bytes += kServiceTag;
  std::size_t size = service.size();
  for (; size >= 0x80; size >>= 7) bytes += char((size & 0x7f) | 0x80);
  bytes += char(size);
  return bytes + service;
}

// Nothing: it is no such message.
std::optional<std::uint32_t> read_status(const grpc::ByteBuffer& response) {
  grpc::Slice slice;
  if (!response.DumpToSingleSlice(&slice).ok()) return std::nullopt;
  google::protobuf::io::CodedInputStream input(slice.begin(), int(slice.size()));
  std::uint32_t status = 0;  // UNKNOWN
  for (std::uint32_t tag; (tag = input.ReadTag()) != 0;) {
    if (tag != std::uint32_t(kStatusTag) || !input.ReadVarint32(&status)) return std::nullopt;
  }
  return status;
}

}  // namespace

Result<bool> is_serving(const ServiceLink& link, const std::string& service) {
  const grpc::Slice slice(request_bytes(service));
  const grpc::ByteBuffer request(&slice, 1);
  grpc::ClientContext context;
  link.authorize(context);
  context.set_deadline(deadline_in(link.options().call_timeout_s));
  grpc::GenericStub stub(link.channel());
  grpc::CompletionQueue queue;
  const auto call = stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", request, &queue);
  call->StartCall();
  grpc::ByteBuffer response;
  grpc::Status status;
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  if (status.error_code() == grpc::StatusCode::NOT_FOUND)
    return Error{ErrorCode::not_found, "'" + service + "'; the server at " + link.peer() + " has no such service",
                 "service"};
  if (!status.ok()) return to_error(status, link.peer());
  const auto told = read_status(response);
  if (!told) return Error{ErrorCode::internal, "the server at " + link.peer() + " answers no health", {}};
  return *told == kServing;
}

}  // namespace helio
