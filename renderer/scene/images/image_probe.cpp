#include "renderer/scene/images/image_probe.h"

#include <algorithm>
#include <cstring>
#include <string_view>

namespace helio {
namespace {

// Deflate cannot do better than 258 bytes from 2 bits; Huffman with run lengths (PIZ, JPEG blocks) stays in that order.
constexpr double kDeflateRatio = 1032;
constexpr double kJpegRatio = 2048;
// One frequency per 8x8 block, deflated.
constexpr double kDwaRatio = 64 * kDeflateRatio;

// Reads integers at byte offsets; out of range is remembered and reads as 0.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool has(std::size_t at, std::size_t count) const { return at <= bytes_.size() && count <= bytes_.size() - at; }
  std::uint32_t u8(std::size_t at) const { return has(at, 1) ? bytes_[at] : 0; }
  std::uint32_t be16(std::size_t at) const { return u8(at) << 8 | u8(at + 1); }
  std::uint32_t be32(std::size_t at) const { return be16(at) << 16 | be16(at + 2); }
  std::uint32_t le16(std::size_t at) const { return u8(at) | u8(at + 1) << 8; }
  std::uint32_t le32(std::size_t at) const { return le16(at) | le16(at + 2) << 16; }
  bool matches(std::size_t at, std::string_view text) const {
    return has(at, text.size()) && std::memcmp(bytes_.data() + at, text.data(), text.size()) == 0;
  }
  // The zero-terminated string at `at`, at most 255 characters; advances `at` past its terminator. False: none there.
  bool string(std::size_t& at, std::string_view& text) const {
    const std::size_t limit = std::min(bytes_.size(), at + 256);
    for (std::size_t end = at; end < limit; ++end) {
      if (bytes_[end] != 0) continue;
      text = std::string_view(reinterpret_cast<const char*>(bytes_.data()) + at, end - at);
      at = end + 1;
      return true;
    }
    return false;
  }
  std::size_t size() const { return bytes_.size(); }

 private:
  std::span<const std::uint8_t> bytes_;
};

void probe_png(const Reader& in, ImageProbe& probe) {
  probe.format = ImageFormat::png;
  probe.max_ratio = kDeflateRatio;
  probe.apple_png = in.matches(12, "CgBI");
  if (!in.matches(12, "IHDR") || !in.has(16, 13)) return;
  constexpr int kSamples[7] = {1, 0, 3, 1, 2, 0, 4};  // by colour type
  const std::uint32_t type = in.u8(25);
  probe.width = in.be32(16);
  probe.height = in.be32(20);
  probe.bits_per_pixel = (type < 7 ? kSamples[type] : 0) * double(in.u8(24));
}

// ITU-T T.81 annex B: segments with 16-bit lengths; after a start of scan, entropy-coded bytes up to the next marker
// that is neither a stuffed zero nor a restart.
void probe_jpeg(const Reader& in, ImageProbe& probe) {
  probe.format = ImageFormat::jpeg;
  probe.max_ratio = kJpegRatio;
  probe.cut_off = true;
  std::size_t at = 2;
  while (in.has(at, 2)) {
    const std::uint32_t marker = in.u8(at + 1);
    if (in.u8(at) != 0xff || marker == 0 || marker == 0xff || (marker >= 0xd0 && marker <= 0xd7)) {
      ++at;
      continue;
    }
    if (marker == 0xd9) {
      probe.cut_off = false;
      return;
    }
    const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame && in.has(at, 10) && probe.width < 0) {
      probe.height = in.be16(at + 5);
      probe.width = in.be16(at + 7);
      probe.bits_per_pixel = 8.0 * in.u8(at + 9);
    }
    at += 2 + in.be16(at + 2);
  }
}

double exr_bits_per_pixel(const Reader& in, std::size_t at, std::size_t end) {
  double bits = 0;
  std::string_view name;
  while (at < end && in.u8(at) != 0) {
    if (!in.string(at, name) || !in.has(at, 16)) return bits;
    const double samples = double(std::max(1u, in.le32(at + 8))) * double(std::max(1u, in.le32(at + 12)));
    bits += (in.le32(at) == 1 ? 16 : 32) / samples;
    at += 16;
  }
  return bits;
}

// OpenEXR file layout: attributes "name type size value", a zero byte ends a header, an empty one ends a multi-part
// list.
void probe_exr(const Reader& in, ImageProbe& probe) {
  probe.format = ImageFormat::exr;
  probe.max_ratio = kDeflateRatio;
  const std::uint32_t version = in.le32(4);
  const bool multi_part = version & 0x1000;
  probe.deep = version & 0x800;
  std::size_t at = 8;
  bool first_attribute = true;
  while (in.has(at, 1)) {
    if (in.u8(at) == 0) {
      ++at;
      if (!multi_part || first_attribute) return;
      first_attribute = true;
      continue;
    }
    first_attribute = false;
    std::string_view name, type;
    if (!in.string(at, name) || !in.string(at, type) || !in.has(at, 4)) return;
    const std::size_t size = in.le32(at);
    at += 4;
    if (!in.has(at, size)) return;
    const auto coordinate = [&](int i) { return std::int64_t(std::int32_t(in.le32(at + std::size_t(4 * i)))); };
    if (name == "dataWindow" && size == 16) {
      probe.width = std::max(probe.width, coordinate(2) - coordinate(0) + 1);
      probe.height = std::max(probe.height, coordinate(3) - coordinate(1) + 1);
    } else if (name == "displayWindow" && size == 16) {
      probe.display_width = std::max(probe.display_width, coordinate(2) - coordinate(0) + 1);
      probe.display_height = std::max(probe.display_height, coordinate(3) - coordinate(1) + 1);
    } else if (name == "channels") {
      probe.bits_per_pixel = std::max(probe.bits_per_pixel, exr_bits_per_pixel(in, at, at + size));
    } else if (name == "compression" && size == 1 && in.u8(at) >= 8) {
      probe.max_ratio = kDwaRatio;
    } else if (name == "type" && in.matches(at, "deep")) {
      probe.deep = true;
    }
    at += size;
  }
}

// RFC 9649: simple lossy, simple lossless, extended. Lossless codes may take no bits, so no ratio bounds the pixels.
void probe_webp(const Reader& in, ImageProbe& probe) {
  probe.format = ImageFormat::webp;
  if (in.matches(12, "VP8X") && in.has(24, 6)) {
    probe.width = 1 + (in.le32(24) & 0xffffff);
    probe.height = 1 + (in.le16(27) | in.u8(29) << 16);
  } else if (in.matches(12, "VP8L") && in.has(21, 4)) {
    probe.width = 1 + (in.le32(21) & 0x3fff);
    probe.height = 1 + (in.le32(21) >> 14 & 0x3fff);
  } else if (in.matches(12, "VP8 ") && in.has(26, 4)) {
    probe.width = in.le16(26) & 0x3fff;
    probe.height = in.le16(28) & 0x3fff;
  }
}

}  // namespace

ImageProbe probe_image(std::span<const std::uint8_t> bytes) {
  const Reader in(bytes);
  ImageProbe probe;
  if (in.matches(0, "\x89PNG\r\n\x1a\n")) {
    probe_png(in, probe);
  } else if (in.matches(0, "\xff\xd8\xff")) {
    probe_jpeg(in, probe);
  } else if (in.matches(0, "\x76\x2f\x31\x01")) {
    probe_exr(in, probe);
  } else if (in.matches(0, "RIFF") && in.matches(8, "WEBP")) {
    probe_webp(in, probe);
  } else if (in.matches(0, "#?RADIANCE") || in.matches(0, "#?RGBE")) {
    probe.format = ImageFormat::hdr;
    probe.max_ratio = kDeflateRatio;
  } else if (in.u8(0) == 'P' && std::strchr("123456fF", int(in.u8(1))) && in.u8(1) != 0 &&
             std::strchr(" \t\r\n#", int(in.u8(2))) && in.u8(2) != 0) {
    probe.format = ImageFormat::pnm;
    probe.max_ratio = 1;
  }
  return probe;
}

}  // namespace helio
