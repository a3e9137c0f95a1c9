#include "client/tev/uncompressed_exr.h"

#include <half.h>

#include <cstring>
#include <limits>
#include <optional>

namespace helio {

namespace {

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint32_t kVersion = 2, kLongNames = 0x400;  // other flags: tiles, deep pixels, several parts
constexpr std::size_t kMostChannels = 64;
constexpr std::int32_t kLargestCoordinate = 1 << 29;  // differences fit an int
constexpr std::int32_t kHalf = 1, kFloat = 2;

Error refuse(const char* message) {
  return {ErrorCode::invalid_argument, message, "exr"};
}

// Reads on, or fails for good.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes, std::size_t at = 0) : bytes_(bytes), at_(at) {}

  template <class T>
  T number() {
    T value{};
    if (const std::uint8_t* from = take(sizeof value)) std::memcpy(&value, from, sizeof value);
    return value;
  }
  std::string_view text() {
    const std::size_t begin = at_;
    while (at_ < bytes_.size() && bytes_[at_] != 0) ++at_;
    if (at_ >= bytes_.size()) failed_ = true;
    const std::string_view value(reinterpret_cast<const char*>(bytes_.data()) + begin, at_ - begin);
    ++at_;
    return value;
  }
  // Null, once bytes are missing.
  const std::uint8_t* take(std::size_t count) {
    if (failed_ || at_ > bytes_.size() || bytes_.size() - at_ < count) {
      failed_ = true;
      return nullptr;
    }
    at_ += count;
    return bytes_.data() + at_ - count;
  }
  bool failed() const { return failed_; }
  std::size_t position() const { return at_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_;
  bool failed_ = false;
};

struct Box {
  std::int32_t x0, y0, x1, y1;  // both ends included
};

std::optional<Box> read_box(ByteReader& reader) {
  Box box{};
  for (std::int32_t* value : {&box.x0, &box.y0, &box.x1, &box.y1}) {
    *value = reader.number<std::int32_t>();
    if (*value < -kLargestCoordinate || *value > kLargestCoordinate) return std::nullopt;
  }
  if (box.x1 < box.x0 || box.y1 < box.y0) return std::nullopt;
  return box;
}

}  // namespace

Result<UncompressedExr> UncompressedExr::open(std::span<const std::uint8_t> bytes) {
  ByteReader reader(bytes);
  if (reader.number<std::uint32_t>() != kMagic) return refuse("is no EXR file");
  if ((reader.number<std::uint32_t>() & ~kLongNames) != kVersion) return refuse("is no flat scanline file of one part");

  UncompressedExr exr;
  std::optional<Box> data, display;
  bool uncompressed = false;
  struct Kind {
    std::string_view name;
    bool is_half;
  };
  std::vector<Kind> kinds;
  for (;;) {
    const std::string_view name = reader.text();
    if (reader.failed()) return refuse("ends within its header");
    if (name.empty()) break;
    reader.text();  // the type
    const auto size = reader.number<std::uint32_t>();
    const std::size_t begin = reader.position();
    if (!reader.take(size)) return refuse("ends within its header");
    ByteReader value(bytes.first(begin + size), begin);
    if (name == "compression") uncompressed = value.number<std::uint8_t>() == 0 && !value.failed();
    if (name == "dataWindow") data = read_box(value);
    if (name == "displayWindow") display = read_box(value);
    if (name != "channels") continue;
    for (;;) {
      const std::string_view channel = value.text();
      if (value.failed()) return refuse("has a list of channels that does not end");
      if (channel.empty()) break;
      const auto type = value.number<std::int32_t>();
      value.take(4);  // whether it is linear, and three bytes without a meaning
      const auto x_sampling = value.number<std::int32_t>(), y_sampling = value.number<std::int32_t>();
      if (value.failed() || x_sampling != 1 || y_sampling != 1 || (type != kHalf && type != kFloat))
        return refuse("has a channel that is subsampled, or neither half nor float");
      kinds.push_back({channel, type == kHalf});
    }
  }
  if (!uncompressed) return refuse("is compressed");
  if (!data || !display) return refuse("has no window, or one that is empty or too far away");
  if (kinds.empty() || kinds.size() > kMostChannels) return refuse("has no channel, or more than 64");

  exr.window_ = {data->x0 - display->x0, data->y0 - display->y0, data->x1 - display->x0 + 1,
                 data->y1 - display->y0 + 1};
  const std::size_t width = std::size_t(exr.window_.width()), height = std::size_t(exr.window_.height());
  std::size_t row_bytes = 0;
  for (const Kind& kind : kinds) {
    exr.channels_.push_back({kind.name, kind.is_half, row_bytes});
    row_bytes += width * (kind.is_half ? 2 : 4);
  }
  // Each row has an offset, its own y and its length. Checked before memory is taken for as many rows.
  if (bytes.size() / (8 + 8 + row_bytes) < height) return refuse("ends before its last row");
  exr.rows_.assign(height, nullptr);
  for (std::size_t i = 0; i < height; ++i) {
    const auto offset = reader.number<std::uint64_t>();
    if (reader.failed() || offset > bytes.size()) return refuse("has a row that lies outside");
    ByteReader row(bytes, std::size_t(offset));
    const std::int64_t y = std::int64_t(row.number<std::int32_t>()) - data->y0;
    const auto size = row.number<std::uint32_t>();
    const std::uint8_t* const pixels = row.take(row_bytes);
    if (!pixels || size != row_bytes || y < 0 || y >= std::int64_t(height) || exr.rows_[std::size_t(y)])
      return refuse("has a row that is cut short, of a wrong length or there twice");
    exr.rows_[std::size_t(y)] = pixels;
  }
  return exr;
}

int UncompressedExr::find(std::string_view name) const {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (channels_[i].name == name) return int(i);
  }
  return -1;
}

void UncompressedExr::read_row(int channel, int y, float* out) const {
  const Channel& from = channels_[std::size_t(channel)];
  const std::uint8_t* bytes = rows_[std::size_t(y - window_.y0)] + from.offset;
  const std::size_t width = std::size_t(window_.width());
  if (!from.is_half) {
    std::memcpy(out, bytes, width * sizeof(float));
    return;
  }
  for (std::size_t x = 0; x < width; ++x) {
    std::uint16_t bits = 0;
    std::memcpy(&bits, bytes + 2 * x, sizeof bits);
    half value;
    value.setBits(bits);
    out[x] = value;
  }
}

}  // namespace helio
