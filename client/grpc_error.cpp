#include "client/grpc_error.h"

#include <charconv>
#include <string_view>

namespace helio {
namespace {

// Seconds of the status's google.rpc.RetryInfo, which the daemon's message ends with as well; 0: there is none.
double retry_after_s(const grpc::Status& status) {
  const std::string& text = status.error_message();
  static constexpr std::string_view kWords = "; try again in ";
  const std::size_t words = text.rfind(kWords);
  if (words == std::string::npos || status.error_details().find("google.rpc.RetryInfo") == std::string::npos) return 0;
  double seconds = 0;
  const char* const end = text.data() + text.size();
  std::from_chars(text.data() + words + kWords.size(), end, seconds);
  return seconds > 0 ? seconds : 0;
}

}  // namespace

Error to_error(const grpc::Status& status, const std::string& peer) {
  const std::string& text = status.error_message();
  switch (status.error_code()) {
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE:
      return {ErrorCode::invalid_argument, text, {}};
    case grpc::StatusCode::NOT_FOUND:
      return {ErrorCode::not_found, text, {}};
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::ALREADY_EXISTS:
    case grpc::StatusCode::ABORTED:
      return {ErrorCode::failed_precondition, text, {}};
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      // gRPC's server resets a stream with ENHANCE_YOUR_CALM (RFC 9113, section 7) when its memory quota is reached.
      if (text.find("RST_STREAM with error code 11") != std::string::npos) {
        return {ErrorCode::resource_exhausted,
                "the server at " + peer +
                    " has no memory left for the messages of this call (its --max-rpc-memory); try again later",
                {}};
      }
      return {ErrorCode::resource_exhausted, text, {}, retry_after_s(status)};
    case grpc::StatusCode::PERMISSION_DENIED:
    case grpc::StatusCode::UNAUTHENTICATED:
      return {ErrorCode::permission_denied, text, {}};
    case grpc::StatusCode::UNIMPLEMENTED:
      return {ErrorCode::unimplemented, text.empty() ? "the server at " + peer + " does not know this call" : text, {}};
    case grpc::StatusCode::CANCELLED:
      return {ErrorCode::cancelled, text.empty() ? "cancelled" : text, {}};
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      // gRPC's own words where the deadline was this client's.
      if (!text.empty() && text != "Deadline Exceeded") return {ErrorCode::unavailable, text, {}};
      return {ErrorCode::unavailable, "the server at " + peer + " did not answer in time", {}};
    case grpc::StatusCode::UNAVAILABLE:
      return {ErrorCode::unavailable, "the server at " + peer + " is not available: " + text, {},
              retry_after_s(status)};
    default:
      return {ErrorCode::internal, text.empty() ? "the call failed without a reason" : text, {}};
  }
}

}  // namespace helio
