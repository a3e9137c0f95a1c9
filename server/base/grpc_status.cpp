#include "server/base/grpc_status.h"

#include <google/protobuf/any.pb.h>
#include <google/protobuf/duration.pb.h>
#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <cstdint>
#include <new>

namespace helio {
namespace {

grpc::StatusCode to_grpc_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::invalid_argument:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case ErrorCode::not_found:
      return grpc::StatusCode::NOT_FOUND;
    case ErrorCode::failed_precondition:
      return grpc::StatusCode::FAILED_PRECONDITION;
    case ErrorCode::resource_exhausted:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case ErrorCode::permission_denied:
      return grpc::StatusCode::PERMISSION_DENIED;
    case ErrorCode::unimplemented:
      return grpc::StatusCode::UNIMPLEMENTED;
    case ErrorCode::cancelled:
      return grpc::StatusCode::CANCELLED;
    case ErrorCode::unavailable:
      return grpc::StatusCode::UNAVAILABLE;
    case ErrorCode::internal:
      return grpc::StatusCode::INTERNAL;
  }
  return grpc::StatusCode::UNKNOWN;
}

void add_field(std::string& message, int number, const std::string& bytes) {
  constexpr int kLengthDelimited = 2;
  message += char(number << 3 | kLengthDelimited);
  std::size_t size = bytes.size();
  for (; size >= 0x80; size >>= 7) message += char((size & 0x7f) | 0x80);
  message += char(size);
  message += bytes;
}

// A serialized google.rpc.Status { code = 1; message = 2; Any details = 3 } of RetryInfo { Duration retry_delay = 1 }.
// Their definitions come with no package that we use.
std::string retry_details(grpc::StatusCode code, const std::string& text, double seconds) {
  google::protobuf::Duration delay;
  delay.set_seconds(std::int64_t(seconds));
  delay.set_nanos(std::int32_t((seconds - std::floor(seconds)) * 1e9));
  std::string retry_info;
  add_field(retry_info, 1, delay.SerializeAsString());
  google::protobuf::Any detail;
  detail.set_type_url("type.googleapis.com/google.rpc.RetryInfo");
  detail.set_value(retry_info);
  std::string status{char(1 << 3), char(code)};
  add_field(status, 2, text);
  add_field(status, 3, detail.SerializeAsString());
  return status;
}

grpc::Status describe(const Error& error) {
  std::string text = error.to_string();
  if (text.size() > kMaxStatusMessage) {
    std::size_t end = kMaxStatusMessage;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;  // keep UTF-8 whole
    text.resize(end);
    text += " ...";
  }
  const grpc::StatusCode code = to_grpc_code(error.code);
  if (!(error.retry_after_s > 0)) return {code, text};
  text += fmt::format("; try again in {:g} s", error.retry_after_s);
  return {code, text, retry_details(code, text, error.retry_after_s)};
}

}  // namespace

grpc::Status to_grpc_status(const Error& error) noexcept {
  try {
    return describe(error);
  } catch (const std::bad_alloc&) {
    return out_of_memory();
  }
}

grpc::Status copy_status(const grpc::Status& status) noexcept {
  try {
    return status;
  } catch (const std::bad_alloc&) {
    return {status.error_code(), ""};
  }
}

grpc::Status out_of_memory() noexcept {
  return {grpc::StatusCode::RESOURCE_EXHAUSTED, "out of memory"};
}

}  // namespace helio
