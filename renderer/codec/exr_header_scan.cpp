#include "renderer/codec/exr_header_scan.h"

#include <cstring>
#include <string_view>

namespace helio {
namespace {

constexpr std::uint8_t kMagic[4] = {0x76, 0x2f, 0x31, 0x01};
constexpr std::uint32_t kVersion = 2, kVersionMask = 0xff;
constexpr std::uint32_t kTiled = 0x200, kLongNames = 0x400, kDeep = 0x800, kMultipart = 0x1000;
constexpr std::size_t kLongestName = 255;

Error refuse(std::string message) {
  return {ErrorCode::invalid_argument, std::move(message), "exr"};
}

// Reads little-endian values; false at the end of the bytes.
class Cursor {
 public:
  explicit Cursor(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  bool u32(std::uint32_t& value) {
    if (rest_.size() < 4) return false;
    value = rest_[0] | std::uint32_t(rest_[1]) << 8 | std::uint32_t(rest_[2]) << 16 | std::uint32_t(rest_[3]) << 24;
    rest_ = rest_.subspan(4);
    return true;
  }
  // A NUL-terminated string of at most kLongestName bytes.
  bool name(std::string_view& value) {
    const std::size_t limit = std::min(rest_.size(), kLongestName + 1);
    const void* end = limit > 0 ? std::memchr(rest_.data(), 0, limit) : nullptr;
    if (end == nullptr) return false;
    const std::size_t length = std::size_t(static_cast<const std::uint8_t*>(end) - rest_.data());
    value = {reinterpret_cast<const char*>(rest_.data()), length};
    rest_ = rest_.subspan(length + 1);
    return true;
  }
  bool take(std::size_t size, std::span<const std::uint8_t>& value) {
    if (rest_.size() < size) return false;
    value = rest_.first(size);
    rest_ = rest_.subspan(size);
    return true;
  }
  bool empty() const { return rest_.empty(); }
  std::size_t left() const { return rest_.size(); }

 private:
  std::span<const std::uint8_t> rest_;
};

// The attribute types whose values carry sizes of their own.
bool inner_sizes_fit(std::string_view type, std::span<const std::uint8_t> value) {
  Cursor cursor(value);
  std::span<const std::uint8_t> ignored;
  std::uint32_t size = 0;
  if (type == "stringvector") {
    while (!cursor.empty()) {
      if (!cursor.u32(size) || !cursor.take(size, ignored)) return false;
    }
  } else if (type == "preview") {
    std::uint32_t width = 0, height = 0;
    if (!cursor.u32(width) || !cursor.u32(height)) return false;
    if (std::uint64_t(width) * height > value.size() / 4) return false;
  } else if (type == "idmanifest") {
    return false;  // a compressed table that we have no use for
  }
  return true;
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

}  // namespace

Result<std::size_t> scan_exr_header(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 8 || std::memcmp(bytes.data(), kMagic, sizeof(kMagic)) != 0) return refuse("not an EXR file");
  Cursor cursor(bytes.subspan(4));
  std::uint32_t version = 0;
  cursor.u32(version);
  if (Status known = check_version(version); !known) return known.error();
  for (;;) {
    std::string_view name, type;
    std::uint32_t size = 0;
    std::span<const std::uint8_t> value;
    if (!cursor.name(name)) return refuse("truncated header");
    if (name.empty()) return bytes.size() - cursor.left();
    if (!cursor.name(type) || !cursor.u32(size)) return refuse("truncated header");
    if (!cursor.take(size, value) || !inner_sizes_fit(type, value)) {
      return refuse("attribute \"" + std::string(name) + "\" claims more bytes than the file has, or is not supported");
    }
  }
}

}  // namespace helio
