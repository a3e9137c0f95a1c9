#include "server/stream/tile_encoder.h"

#include <algorithm>

#include "renderer/codec/checksum.h"

namespace helio {
namespace {

// Half holds the integers up to here; larger sample counts are written as float.
constexpr float kLargestExactHalfCount = 2048;

std::vector<TileChannel> film_channels(const ResolvedTile& pixels, const TileFormat& format) {
  std::vector<TileChannel> channels;
  channels.reserve(21);
  for (const Channel& channel : channel_table()) {
    if (!channel.in(format.channels)) continue;
    for (const ChannelPlane& plane : channel.planes) {
      const std::vector<float>& data = plane.of(pixels);
      if (data.empty()) continue;
      const bool many = plane.storage == Storage::count &&
                        std::any_of(data.begin(), data.end(), [](float n) { return n > kLargestExactHalfCount; });
      channels.push_back({plane.name, data.data(), many || plane.storage == Storage::float32,
                          plane.storage == Storage::positive_half});
    }
  }
  return channels;
}

std::vector<TileChannel> preview_channels(const ResolvedTile& pixels) {
  return {{"display.R", pixels.display[0].data(), false, false},
          {"display.G", pixels.display[1].data(), false, false},
          {"display.B", pixels.display[2].data(), false, false}};
}

}  // namespace

std::uint64_t TileFormat::bytes_per_pixel() const {
  const std::uint64_t value = encoding.pixel_type == TilePixelType::half ? 2 : 4;
  std::uint64_t bytes = 0;
  for (const Channel& channel : channel_table()) {
    if (!channel.in(channels)) continue;
    for (const ChannelPlane& plane : channel.planes)
      bytes += plane.storage == Storage::float32 || plane.storage == Storage::count ? 4 : value;
  }
  return bytes;
}

Result<EncodedTile> encode(const FrameTile& tile, int frame_width, int frame_height, const TileFormat& format) {
  const ResolvedTile& pixels = tile.pixels;
  const std::vector<TileChannel> channels = tile.preview ? preview_channels(pixels) : film_channels(pixels, format);
  TileEncoding encoding = format.encoding;
  if (tile.preview) encoding.pixel_type = TilePixelType::half;
  auto exr = encode_tile({pixels.window, frame_width, frame_height}, channels, encoding);
  if (!exr) return exr.error();

  EncodedTile encoded;
  encoded.tag = tile.tag;
  encoded.window = pixels.window;
  encoded.pass = tile.pass;
  encoded.final = tile.final;
  encoded.preview = tile.preview;
  encoded.samples_per_pixel = tile.samples_per_pixel;
  encoded.invalid_samples = pixels.invalid_samples;
  encoded.exr = std::move(*exr);
  encoded.crc32 = crc32_of(encoded.exr.data(), encoded.exr.size());
  return encoded;
}

}  // namespace helio
