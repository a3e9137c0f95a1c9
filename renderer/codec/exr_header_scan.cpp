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

// Attribute types of a fixed size. OpenEXR reads what the type needs, whatever the size says, and would take the rest
// for the next attribute.
struct FixedSize {
  std::string_view type;
  std::size_t bytes;
};
constexpr FixedSize kFixedSizes[] = {
    {"box2i", 16},
    {"box2f", 16},
    {"chromaticities", 32},
    {"compression", 1},
    {"deepImageState", 1},
    {"double", 8},
    {"envmap", 1},
    {"float", 4},
    {"int", 4},
    {"keycode", 28},
    {"lineOrder", 1},
    {"m33f", 36},
    {"m33d", 72},
    {"m44f", 64},
    {"m44d", 128},
    {"rational", 8},
    {"tiledesc", 9},
    {"timecode", 8},
    {"v2i", 8},
    {"v2f", 8},
    {"v2d", 16},
    {"v3i", 12},
    {"v3f", 12},
    {"v3d", 24},
};

// Names, each with 16 bytes, until an empty name, which ends the value.
bool is_channel_list(std::span<const std::uint8_t> value) {
  Cursor cursor(value);
  for (;;) {
    std::string_view name;
    std::span<const std::uint8_t> ignored;
    if (!cursor.name(name)) return false;
    if (name.empty()) return cursor.empty();
    if (!cursor.take(16, ignored)) return false;
  }
}

bool is_string_vector(std::span<const std::uint8_t> value) {
  Cursor cursor(value);
  while (!cursor.empty()) {
    std::uint32_t size = 0;
    std::span<const std::uint8_t> ignored;
    if (!cursor.u32(size) || !cursor.take(size, ignored)) return false;
  }
  return true;
}

// Width, height, four bytes a pixel.
bool is_preview(std::span<const std::uint8_t> value) {
  Cursor cursor(value);
  std::uint32_t width = 0, height = 0;
  return cursor.u32(width) && cursor.u32(height) && cursor.left() % 4 == 0 &&
         std::uint64_t(width) * height == cursor.left() / 4;
}

// Whether OpenEXR will read the value, the whole value and nothing else.
bool is_consistent(std::string_view type, std::span<const std::uint8_t> value) {
  if (type == "chlist") return is_channel_list(value);
  if (type == "stringvector") return is_string_vector(value);
  if (type == "preview") return is_preview(value);
  if (type == "floatvector") return value.size() % 4 == 0;
  if (type == "idmanifest") return false;  // a compressed table that we have no use for
  for (const FixedSize& fixed : kFixedSizes) {
    if (type == fixed.type) return value.size() == fixed.bytes;
  }
  return true;  // a string, or of a type that OpenEXR keeps as it is
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
    if (!cursor.take(size, value) || !is_consistent(type, value)) {
      return refuse("attribute \"" + std::string(name) + "\" has another size than it claims, or is not supported");
    }
  }
}

}  // namespace helio
