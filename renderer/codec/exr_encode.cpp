#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>

#include <algorithm>
#include <cstring>
#include <sstream>

#include "renderer/codec/exr_encode_rows.h"
#include "renderer/codec/exr_streams.h"
#include "renderer/codec/stored_channel.h"

namespace helio {
namespace {

constexpr std::size_t kLongestName = 255;

std::string describe(const PixelRect& r) {
  std::ostringstream text;
  text << '[' << r.x0 << ", " << r.x1 << ") x [" << r.y0 << ", " << r.y1 << ')';
  return text.str();
}

Status validate(const TileHeader& header, std::span<const TileChannel> channels) {
  Problems problems;
  const PixelRect frame{0, 0, header.frame_width, header.frame_height};
  if (header.data_window.empty() || intersect(header.data_window, frame) != header.data_window) {
    problems.add("data_window", describe(header.data_window) + " is empty or not inside the frame " + describe(frame));
  }
  if (channels.empty()) problems.add("channels", "none given");
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const TileChannel& channel = channels[i];
    const std::string where = "channels[" + std::to_string(i) + "]";
    if (channel.name.empty() || channel.name.size() > kLongestName || channel.name.find('\0') != std::string::npos) {
      problems.add(where + ".name", "must have 1 to 255 bytes without NUL");
    }
    if (channel.data == nullptr) problems.add(where + ".data", "is null");
    for (std::size_t j = 0; j < i; ++j) {
      if (channels[j].name == channel.name) problems.add(where + ".name", "\"" + channel.name + "\" is given twice");
    }
  }
  if (!problems.empty()) return problems.to_error();
  return ok_status();
}

// In the file's channel order: by name.
std::vector<StoredChannel> store(std::span<const TileChannel> channels, TilePixelType type) {
  std::vector<const TileChannel*> sorted;
  for (const TileChannel& channel : channels) sorted.push_back(&channel);
  std::sort(sorted.begin(), sorted.end(), [](const TileChannel* a, const TileChannel* b) { return a->name < b->name; });
  std::vector<StoredChannel> stored(sorted.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const TileChannel& from = *sorted[i];
    StoredChannel& to = stored[i];
    to.name = from.name.c_str();
    to.type = from.keep_float ? TilePixelType::float32 : type;
    to.value_bytes = to.type == TilePixelType::float32 ? 4 : 2;
    to.keep_positive = from.keep_positive;
    to.values = from.data;
  }
  return stored;
}

Imf::Compression to_exr(TileCompression compression) {
  switch (compression) {
    case TileCompression::none:
      return Imf::NO_COMPRESSION;
    case TileCompression::rle:
      return Imf::RLE_COMPRESSION;
    case TileCompression::zips:
      return Imf::ZIPS_COMPRESSION;
    case TileCompression::zip:
      return Imf::ZIP_COMPRESSION;
    case TileCompression::piz:
      return Imf::PIZ_COMPRESSION;
    case TileCompression::dwaa:
      return Imf::DWAA_COMPRESSION;
  }
  return Imf::NO_COMPRESSION;
}

Status encode_compressed(const TileHeader& tile, std::span<const StoredChannel> channels, TileCompression compression,
                         std::vector<std::uint8_t>& bytes) {
  try {
    const PixelRect& w = tile.data_window;
    const Imath::Box2i data({w.x0, w.y0}, {w.x1 - 1, w.y1 - 1});
    Imf::Header header(Imath::Box2i({0, 0}, {tile.frame_width - 1, tile.frame_height - 1}), data);
    header.compression() = to_exr(compression);
    header.insert("software", Imf::StringAttribute(kExrSoftware));
    if (!tile.comments.empty()) header.insert("comments", Imf::StringAttribute(tile.comments));
    if (!tile.origin.empty()) header.insert(kExrOrigin, Imf::StringAttribute(tile.origin));
    Imf::FrameBuffer frame;
    const std::size_t values = std::size_t(w.area());
    std::vector<std::vector<char>> planes;
    for (const StoredChannel& channel : channels) {
      const Imf::PixelType type = channel.type == TilePixelType::half ? Imf::HALF : Imf::FLOAT;
      header.channels().insert(channel.name, Imf::Channel(type));
      std::vector<char>& plane = planes.emplace_back(values * channel.value_bytes);
      channel.write(0, values, plane.data());
      frame.insert(channel.name, Imf::Slice::Make(type, plane.data(), data, channel.value_bytes,
                                                  channel.value_bytes * std::size_t(w.width())));
    }
    MemoryWriter stream(bytes);
    constexpr int kNoThreads = 0;
    Imf::OutputFile file(stream, header, kNoThreads);
    file.setFrameBuffer(frame);
    file.writePixels(w.height());
  } catch (const std::exception& e) {
    return Error{ErrorCode::internal, e.what(), "exr"};
  }
  return ok_status();
}

}  // namespace

Result<std::vector<std::uint8_t>> encode_tile(const TileHeader& header, std::span<const TileChannel> channels,
                                              const TileEncoding& encoding) {
  if (Status valid = validate(header, channels); !valid) return valid.error();
  const std::size_t values = std::size_t(header.data_window.area());
  const std::vector<StoredChannel> stored = store(channels, encoding.pixel_type);

  // Room for the whole uncompressed file: header, one offset and one chunk header per row, values.
  std::size_t room =
      512 + header.comments.size() + header.origin.size() + 16 * std::size_t(header.data_window.height());
  for (const StoredChannel& channel : stored) room += std::strlen(channel.name) + 32 + values * channel.value_bytes;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(room);
  const Status done = encoding.compression == TileCompression::none
                          ? encode_rows(header, stored, bytes)
                          : encode_compressed(header, stored, encoding.compression, bytes);
  if (!done) return done.error();
  return bytes;
}

}  // namespace helio
