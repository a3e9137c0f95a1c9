// Small tiles for the codec's tests.
#pragma once

#include <string>
#include <vector>

#include "renderer/codec/tile_codec.h"
#include "tests/support/random.h"

namespace helio::test {

// Channels as the daemon sends them, filled with noise in [0, 4).
struct NoiseTile {
  TileHeader header;
  std::vector<std::string> names;
  std::vector<std::vector<float>> values;

  NoiseTile(const PixelRect& window, int frame_width, int frame_height,
            std::vector<std::string> channel_names = {"R", "G", "B", "variance.R", "variance.G", "variance.B",
                                                      "samples"})
      : header{window, frame_width, frame_height}, names(std::move(channel_names)) {
    Random random(7);
    for (std::size_t i = 0; i < names.size(); ++i) {
      std::vector<float>& channel = values.emplace_back(std::size_t(window.area()));
      for (float& v : channel) v = 4.0f * random.next_float();
    }
  }

  std::vector<TileChannel> channels() const {
    std::vector<TileChannel> all;
    for (std::size_t i = 0; i < names.size(); ++i) all.push_back({names[i], values[i].data()});
    return all;
  }
};

inline constexpr TileCompression kCompressions[] = {TileCompression::none, TileCompression::rle, TileCompression::zips,
                                                    TileCompression::zip,  TileCompression::piz, TileCompression::dwaa};

inline std::vector<std::uint8_t> encode_or_die(const NoiseTile& tile, const TileEncoding& encoding) {
  Result<std::vector<std::uint8_t>> bytes = encode_tile(tile.header, tile.channels(), encoding);
  if (!bytes) throw std::runtime_error(bytes.error().to_string());
  return *bytes;
}

}  // namespace helio::test
