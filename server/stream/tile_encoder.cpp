#include "server/stream/tile_encoder.h"

#include <algorithm>
#include <array>

#include "renderer/codec/checksum.h"

namespace helio {
namespace {

// Half holds the integers up to here; larger sample counts are written as float.
constexpr float kLargestExactHalfCount = 2048;

}  // namespace

std::uint64_t TileFormat::bytes_per_pixel() const {
  const std::uint64_t value = encoding.pixel_type == TilePixelType::half ? 2 : 4;
  std::uint64_t bytes = 3 * value;
  if (channels & kResolveVariance) bytes += 3 * value;
  if (channels & kResolveSamples) bytes += 4;
  if (channels & kResolveAlpha) bytes += value;
  if (channels & kResolveDepth) bytes += 4;
  if (channels & kResolveNormal) bytes += 3 * value;
  if (channels & kResolveAlbedo) bytes += 3 * value;
  if (channels & kResolveHistory) bytes += 3 * value;
  if (channels & kResolveDensity) bytes += value;
  return bytes;
}

Result<EncodedTile> encode(const FrameTile& tile, int frame_width, int frame_height, const TileFormat& format) {
  const ResolvedTile& pixels = tile.pixels;
  std::vector<TileChannel> channels;
  channels.reserve(21);
  const auto add = [&](const char* name, const std::vector<float>& data, bool keep_float = false,
                       bool keep_positive = false) {
    if (!data.empty()) channels.push_back({name, data.data(), keep_float, keep_positive});
  };
  const auto add_three = [&](std::array<const char*, 3> names, const std::vector<float>(&data)[3],
                             bool keep_positive = false) {
    for (int c = 0; c < 3; ++c) add(names[c], data[c], false, keep_positive);
  };
  add_three({"R", "G", "B"}, pixels.radiance);
  if (format.channels & kResolveVariance) add_three({"variance.R", "variance.G", "variance.B"}, pixels.variance, true);
  if (format.channels & kResolveSamples) {
    const bool many =
        std::any_of(pixels.samples.begin(), pixels.samples.end(), [](float n) { return n > kLargestExactHalfCount; });
    add("samples", pixels.samples, many);
  }
  if (format.channels & kResolveAlpha) add("A", pixels.alpha);
  if (format.channels & kResolveDepth) add("Z", pixels.depth, true);
  if (format.channels & kResolveNormal) add_three({"N.x", "N.y", "N.z"}, pixels.normal);
  if (format.channels & kResolveAlbedo) add_three({"albedo.r", "albedo.g", "albedo.b"}, pixels.albedo);
  if (format.channels & kResolveHistory) {
    add("history.weight", pixels.history_weight, false, true);
    add("bias.bound", pixels.bias_bound, false, true);
    add("history.age", pixels.history_age);
  }
  if (format.channels & kResolveDensity) add("samples.density", pixels.density);

  auto exr = encode_tile({pixels.window, frame_width, frame_height}, channels, format.encoding);
  if (!exr) return exr.error();

  EncodedTile encoded;
  encoded.tag = tile.tag;
  encoded.window = pixels.window;
  encoded.pass = tile.pass;
  encoded.final = tile.final;
  encoded.samples_per_pixel = tile.samples_per_pixel;
  encoded.invalid_samples = pixels.invalid_samples;
  encoded.exr = std::move(*exr);
  encoded.crc32 = crc32_of(encoded.exr.data(), encoded.exr.size());
  return encoded;
}

}  // namespace helio
