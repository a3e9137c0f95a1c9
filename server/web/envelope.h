// The envelope of the page's WebSocket (proto/heliograph/v1/web.proto). What it carries is neither parsed nor copied
// here: that is the service's part.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "renderer/base/result.h"

namespace helio {

// A call that an envelope may carry: a field of WebRequest's oneof, named as a method of RenderService.
struct WebCall {
  int field = 0;       // of its messages, in WebRequest and WebResponse
  std::string method;  // "/heliograph.v1.RenderService/StreamFrames"
  bool many_requests = false;
};
// Null: this daemon knows no such call.
const WebCall* find_web_call(int field);

struct Envelope {
  std::uint64_t id = 0;
  int field = 0;  // number in WebRequest's oneof, the last one that is there; 0: none
  std::span<const std::uint8_t> content;
};

inline constexpr std::uint64_t kMaxCallId = (1ull << 53) - 1;  // what a page's numbers hold

// Unknown fields are skipped, but those that carry messages: they are calls of newer pages. invalid_argument: this is
// no protobuf message, or the id is out of range.
Result<Envelope> read_envelope(std::span<const std::uint8_t> message);

// The bytes of a WebResponse that come before those of its content.
std::string envelope_head(std::uint64_t id, int field, std::size_t content_bytes);

}  // namespace helio
