#include "server/stream/tile_encoder.h"

#include <algorithm>
#include <cmath>

#include "renderer/codec/checksum.h"
#include "renderer/codec/display_image.h"
#include "renderer/codec/jpeg_file.h"

namespace helio {
namespace {

// Half holds the integers up to here; larger sample counts are written as float.
constexpr float kLargestExactHalfCount = 2048;

TileChannel to_tile_channel(const ChannelPlane& plane, const std::vector<float>& data) {
  const bool many = plane.storage == Storage::count &&
                    std::any_of(data.begin(), data.end(), [](float n) { return n > kLargestExactHalfCount; });
  return {plane.name, data.data(), many || plane.storage == Storage::float32, plane.storage == Storage::positive_half};
}

// Calls use(plane) for each plane of the channels.
template <class Use>
void for_each_plane(unsigned channels, const Use& use) {
  for (const Channel& channel : channel_table()) {
    if (!channel.in(channels)) continue;
    for (const ChannelPlane& plane : channel.planes) use(plane);
  }
}

std::vector<TileChannel> film_channels(const ResolvedTile& pixels, const TileFormat& format) {
  std::vector<TileChannel> channels;
  channels.reserve(25);
  for_each_plane(format.channels, [&](const ChannelPlane& plane) {
    const std::vector<float>& data = plane.of(pixels);
    if (!data.empty()) channels.push_back(to_tile_channel(plane, data));
  });
  return channels;
}

Result<std::vector<std::uint8_t>> encode_film(const ResolvedTile& pixels, int width, int height,
                                              const TileFormat& format) {
  return encode_tile({pixels.window, width, height}, film_channels(pixels, format), format.encoding);
}

Result<std::vector<std::uint8_t>> encode_preview(const ResolvedTile& pixels, int width, int height,
                                                 const TileFormat& format, double exposure) {
  const float* const planes[] = {pixels.display[0].data(), pixels.display[1].data(), pixels.display[2].data()};
  if (format.preview_jpeg > 0) {
    const PictureView picture{pixels.window.width(), pixels.window.height(), {planes[0], planes[1], planes[2]}};
    return encode_jpeg(picture.width, picture.height, display_bytes(picture, std::exp2(exposure)), format.preview_jpeg);
  }
  const TileChannel channels[] = {{"display.R", planes[0]}, {"display.G", planes[1]}, {"display.B", planes[2]}};
  return encode_tile({pixels.window, width, height}, channels, {TilePixelType::half, format.encoding.compression});
}

}  // namespace

std::uint64_t TileFormat::bytes_per_pixel() const {
  const std::uint64_t value = encoding.pixel_type == TilePixelType::half ? 2 : 4;
  std::uint64_t bytes = 0;
  for_each_plane(channels, [&](const ChannelPlane& plane) {
    bytes += plane.storage == Storage::float32 || plane.storage == Storage::count ? 4 : value;
  });
  return bytes;
}

std::size_t TileFormat::planes() const {
  std::size_t count = 0;
  for_each_plane(channels, [&](const ChannelPlane&) { ++count; });
  return count;
}

PicturePlanes::PicturePlanes(const PixelRect& whole, unsigned channels) : window(whole) {
  for_each_plane(channels, [&](const ChannelPlane& plane) {
    planes.emplace_back(&plane, std::vector<float>(std::size_t(whole.area())));
  });
}

void PicturePlanes::put(const ResolvedTile& tile) {
  const auto width = std::size_t(tile.window.width());
  for (auto& [plane, values] : planes) {
    const std::vector<float>& from = plane->of(tile);
    if (from.empty()) continue;
    for (int y = tile.window.y0; y < tile.window.y1; ++y) {
      const auto row = from.begin() + std::ptrdiff_t(std::size_t(y - tile.window.y0) * width);
      const std::size_t at = std::size_t(y - window.y0) * std::size_t(window.width()) +
                             std::size_t(tile.window.x0 - window.x0);
      std::copy_n(row, width, values.begin() + std::ptrdiff_t(at));
    }
  }
}

Result<std::vector<std::uint8_t>> encode_picture(const PicturePlanes& picture, const TileHeader& header,
                                                 const TileEncoding& encoding) {
  std::vector<TileChannel> channels;
  for (const auto& [plane, values] : picture.planes) channels.push_back(to_tile_channel(*plane, values));
  return encode_tile(header, channels, encoding);
}

Result<EncodedTile> encode(const FrameTile& tile, int frame_width, int frame_height, const TileFormat& format,
                           double exposure) {
  const ResolvedTile& pixels = tile.pixels;
  auto bytes = tile.preview ? encode_preview(pixels, frame_width, frame_height, format, exposure)
                            : encode_film(pixels, frame_width, frame_height, format);
  if (!bytes) return bytes.error();

  EncodedTile encoded;
  encoded.tag = tile.tag;
  encoded.window = pixels.window;
  encoded.pass = tile.pass;
  encoded.final = tile.final;
  encoded.preview = tile.preview;
  encoded.samples_per_pixel = tile.samples_per_pixel;
  encoded.invalid_samples = pixels.invalid_samples;
  encoded.jpeg = tile.preview && format.preview_jpeg > 0;
  encoded.bytes = std::move(*bytes);
  encoded.crc32 = crc32_of(encoded.bytes.data(), encoded.bytes.size());
  return encoded;
}

}  // namespace helio
