#include "renderer/codec/exr_header_check.h"

#include <openexr.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <string>

namespace helio {
namespace {

constexpr std::uint8_t kMagic[4] = {0x76, 0x2f, 0x31, 0x01};
constexpr std::uint32_t kVersion = 2, kVersionMask = 0xff;
constexpr std::uint32_t kTiled = 0x200, kLongNames = 0x400, kDeep = 0x800, kMultipart = 0x1000;

using Bytes = std::span<const std::uint8_t>;

Error refuse(std::string message) {
  return {ErrorCode::invalid_argument, std::move(message), "exr"};
}

Status check_version(std::uint32_t version) {
  if ((version & kVersionMask) != kVersion) {
    return refuse("version " + std::to_string(version & kVersionMask) + ", only 2 is known");
  }
  if (version & kTiled) return refuse("a tiled file, only scanline files are read");
  if (version & kDeep) return refuse("a deep file, only flat files are read");
  if (version & kMultipart) return refuse("a file of several parts, only one part is read");
  if (version & ~(kVersionMask | kLongNames)) return refuse("unknown flags in the version field");
  return ok_status();
}

struct Source {
  Bytes bytes;
  std::string fault;  // the first that the library names
};

std::int64_t size_of(exr_const_context_t, void* user) {
  return std::int64_t(static_cast<const Source*>(user)->bytes.size());
}

std::int64_t read_at(exr_const_context_t, void* user, void* to, std::uint64_t size, std::uint64_t offset,
                     exr_stream_error_func_ptr_t) {
  const Bytes& bytes = static_cast<const Source*>(user)->bytes;
  if (offset >= bytes.size()) return 0;
  const std::uint64_t got = std::min<std::uint64_t>(size, bytes.size() - offset);
  std::memcpy(to, bytes.data() + offset, got);
  return std::int64_t(got);
}

void note_fault(exr_const_context_t context, exr_result_t, const char* text) {
  void* user = nullptr;
  if (exr_get_user_data(context, &user) != EXR_ERR_SUCCESS || user == nullptr) return;
  std::string& fault = static_cast<Source*>(user)->fault;
  try {
    if (fault.empty()) fault = text;
  } catch (const std::bad_alloc&) {  // comes from C; the library's code says enough
  }
}

}  // namespace

Status check_exr_header(Bytes bytes) {
  if (bytes.size() < 8 || std::memcmp(bytes.data(), kMagic, sizeof(kMagic)) != 0) return refuse("not an EXR file");
  const std::uint32_t version =
      bytes[4] | std::uint32_t(bytes[5]) << 8 | std::uint32_t(bytes[6]) << 16 | std::uint32_t(bytes[7]) << 24;
  if (Status known = check_version(version); !known) return known;
  Source source{bytes, {}};
  exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
  settings.error_handler_fn = note_fault;
  settings.user_data = &source;
  settings.read_fn = read_at;
  settings.size_fn = size_of;
  settings.flags = EXR_CONTEXT_FLAG_STRICT_HEADER;
  exr_context_t context = nullptr;
  const exr_result_t outcome = exr_start_read(&context, "tile", &settings);
  exr_finish(&context);
  if (outcome != EXR_ERR_SUCCESS) {
    const std::string fault = source.fault.empty() ? exr_get_default_error_message(outcome) : source.fault;
    return refuse("header is broken or cut off: " + fault);
  }
  return ok_status();
}

}  // namespace helio
