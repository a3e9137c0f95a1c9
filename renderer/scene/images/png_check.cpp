#include "renderer/scene/images/png_check.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <new>
#include <string_view>
#include <vector>

namespace helio {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kSignatureBytes = 8, kChunkFrame = 12;  // length, type and CRC around a chunk's data
constexpr std::uint32_t kMaxChunkBytes = 0x7fffffff;
constexpr std::size_t kMaxPaletteBytes = 256 * 3;
constexpr int kFilters = 5;
constexpr int kPalette = 3;  // colour type

std::uint32_t big_endian(Bytes bytes, std::size_t at) {
  return std::uint32_t(bytes[at]) << 24 | std::uint32_t(bytes[at + 1]) << 16 | std::uint32_t(bytes[at + 2]) << 8 |
         bytes[at + 3];
}

struct Chunk {
  std::string_view type;
  Bytes data;
  bool crc_right = false;

  bool critical() const { return (type[0] & 0x20) == 0; }
};

struct Header {
  std::uint32_t width = 0, height = 0;
  int depth = 0, color_type = 0, interlace = 0;

  // Bits of a pixel; 0: no such combination of depth and colour type.
  int bits_per_pixel() const {
    const bool power_of_two = depth == 1 || depth == 2 || depth == 4 || depth == 8 || depth == 16;
    if (!power_of_two) return 0;
    switch (color_type) {
      case 0:
        return depth;
      case 2:
        return depth >= 8 ? 3 * depth : 0;
      case kPalette:
        return depth <= 8 ? depth : 0;
      case 4:
        return depth >= 8 ? 2 * depth : 0;
      case 6:
        return depth >= 8 ? 4 * depth : 0;
      default:
        return 0;
    }
  }
};

// Rows of equal length, each a filter byte and its pixels.
struct Rows {
  std::uint64_t count = 0, bytes = 0;
};

std::vector<Rows> rows_of(const Header& header) {
  const auto add = [&](std::vector<Rows>& all, std::uint64_t width, std::uint64_t height) {
    if (width > 0 && height > 0) all.push_back({height, 1 + (width * header.bits_per_pixel() + 7) / 8});
  };
  std::vector<Rows> all;
  if (header.interlace == 0) {
    add(all, header.width, header.height);
    return all;
  }
  struct Pass {
    std::uint32_t x0, y0, dx, dy;
  };
  constexpr Pass kAdam7[] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                             {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};
  for (const Pass& pass : kAdam7) {
    const auto steps = [](std::uint64_t size, std::uint64_t first, std::uint64_t step) {
      return size > first ? (size - first + step - 1) / step : 0;
    };
    add(all, steps(header.width, pass.x0, pass.dx), steps(header.height, pass.y0, pass.dy));
  }
  return all;
}

// Inflates the image, keeping nothing of it.
class ImageData {
 public:
  explicit ImageData(std::vector<Rows> rows) : rows_(std::move(rows)) {
    if (inflateInit(&stream_) != Z_OK) throw std::bad_alloc();
  }
  ~ImageData() { inflateEnd(&stream_); }
  ImageData(const ImageData&) = delete;
  ImageData& operator=(const ImageData&) = delete;

  std::string take(Bytes compressed) {
    stream_.next_in = const_cast<std::uint8_t*>(compressed.data());
    stream_.avail_in = static_cast<uInt>(compressed.size());
    while (stream_.avail_in > 0 && !over_) {
      stream_.next_out = buffer_.data();
      stream_.avail_out = static_cast<uInt>(buffer_.size());
      const int outcome = inflate(&stream_, Z_NO_FLUSH);
      if (outcome != Z_OK && outcome != Z_STREAM_END) {
        return std::string("PNG data is broken: ") + (stream_.msg ? stream_.msg : "the zlib stream needs a dictionary");
      }
      if (!check_rows({buffer_.data(), buffer_.size() - stream_.avail_out}))
        return "PNG data has a row without a filter";
      over_ = outcome == Z_STREAM_END || (complete() && stream_.avail_out == 0);
    }
    return {};
  }

  bool complete() const { return rows_at_ == rows_.size(); }

 private:
  // Looks at the first byte of each row. What follows the last row does not matter.
  bool check_rows(Bytes bytes) {
    while (!bytes.empty() && !complete()) {
      if (row_at_ == 0 && bytes[0] >= kFilters) return false;
      const std::uint64_t taken = std::min<std::uint64_t>(bytes.size(), rows_[rows_at_].bytes - row_at_);
      bytes = bytes.subspan(taken);
      row_at_ += taken;
      if (row_at_ < rows_[rows_at_].bytes) continue;
      row_at_ = 0;
      if (--rows_[rows_at_].count == 0) ++rows_at_;
    }
    return true;
  }

  z_stream stream_{};
  std::array<std::uint8_t, 1 << 15> buffer_;
  std::vector<Rows> rows_;
  std::size_t rows_at_ = 0;
  std::uint64_t row_at_ = 0;  // bytes of the row in hand that have come
  bool over_ = false;
};

class Walk {
 public:
  explicit Walk(Bytes png) : png_(png) {}

  std::string find_fault() {
    if (!next()) return fault_;
    if (std::string fault = read_header(); !fault.empty()) return fault;
    bool palette = false;
    for (;;) {
      if (!next()) return fault_;
      if (chunk_.type == "IDAT") break;
      if (!chunk_.critical()) continue;
      if (chunk_.type != "PLTE" || palette) return "PNG chunk " + name() + " is out of place before IDAT";
      palette = true;
      const std::size_t bytes = chunk_.data.size();
      const bool usable = bytes > 0 && bytes % 3 == 0 && bytes <= kMaxPaletteBytes;
      if (!usable && header_.color_type == kPalette) return "PNG palette is broken";
    }
    if (header_.color_type == kPalette && !palette) return "PNG has no palette";
    return inflate_image();
  }

 private:
  std::string name() const { return std::string(chunk_.type); }

  // Advances to the next chunk; false when there is none that a decoder could read.
  bool next() {
    if (png_.size() - at_ < kChunkFrame) return fail("PNG data is cut off");
    const std::uint32_t length = big_endian(png_, at_);
    if (length > kMaxChunkBytes) return fail("PNG chunk is longer than 2^31 - 1 bytes");
    chunk_.type = {reinterpret_cast<const char*>(png_.data()) + at_ + 4, 4};
    const bool letters = std::all_of(chunk_.type.begin(), chunk_.type.end(),
                                     [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); });
    if (!letters) return fail("PNG chunk has a type that is not four letters");
    if (length > png_.size() - at_ - kChunkFrame) return fail("PNG data is cut off");
    chunk_.data = png_.subspan(at_ + 8, length);
    const std::uint32_t crc = static_cast<std::uint32_t>(crc32_z(0, png_.data() + at_ + 4, std::size_t(length) + 4));
    const bool right = crc == big_endian(png_, at_ + 8 + length);
    at_ += kChunkFrame + length;
    // Of the others a decoder leaves out what is broken.
    if (!right && chunk_.critical()) return fail("PNG chunk " + name() + " has a wrong CRC");
    return true;
  }

  std::string read_header() {
    if (chunk_.type != "IHDR" || chunk_.data.size() != 13) return "png header is broken or cut off";
    header_ = {big_endian(chunk_.data, 0), big_endian(chunk_.data, 4), chunk_.data[8], chunk_.data[9], chunk_.data[12]};
    if (header_.bits_per_pixel() == 0) {
      return "PNG has no images of depth " + std::to_string(header_.depth) + " and colour type " +
             std::to_string(header_.color_type);
    }
    if (chunk_.data[10] != 0 || chunk_.data[11] != 0 || header_.interlace > 1) {
      return "PNG compression, filter or interlace method is not known";
    }
    return {};
  }

  // From the first IDAT to the last of the run.
  std::string inflate_image() {
    ImageData image(rows_of(header_));
    for (;;) {
      if (std::string fault = image.take(chunk_.data); !fault.empty()) return fault;
      const bool another = png_.size() - at_ >= kChunkFrame && png_[at_ + 4] == 'I' && png_[at_ + 5] == 'D' &&
                           png_[at_ + 6] == 'A' && png_[at_ + 7] == 'T';
      if (!another) return image.complete() ? std::string() : "PNG data ends before the image is complete";
      if (!next()) return fault_;
    }
  }

  bool fail(std::string fault) {
    fault_ = std::move(fault);
    return false;
  }

  Bytes png_;
  std::size_t at_ = kSignatureBytes;
  Chunk chunk_;
  Header header_;
  std::string fault_;
};

}  // namespace

std::string find_png_fault(std::span<const std::uint8_t> png) {
  return Walk(png).find_fault();
}

}  // namespace helio
