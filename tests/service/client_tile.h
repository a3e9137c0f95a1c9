// Tiles as a server would send them, for tests of what a client makes of them.
#pragma once

#include <zlib.h>

#include "heliograph/v1/types.pb.h"
#include "renderer/codec/tile_codec.h"

namespace helio::test {

inline std::uint32_t crc32_of(const std::string& bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<z_size_t>(bytes.size())));
}

// R, G, B all `value` in the window of a width x height frame; the header may be another one than announced.
inline heliograph::v1::Tile make_tile(const PixelRect& window, int width, int height, float value,
                                      std::uint64_t revision = 1, std::uint32_t pass = 0) {
  const std::vector<float> plane(static_cast<std::size_t>(window.area()), value);
  const TileChannel channels[] = {{"R", plane.data()}, {"G", plane.data()}, {"B", plane.data()}};
  const auto bytes = encode_tile({window, width, height}, channels, {});
  heliograph::v1::Tile tile;
  tile.mutable_exr()->assign(bytes->begin(), bytes->end());
  tile.set_crc32(crc32_of(tile.exr()));
  tile.mutable_window()->set_x0(window.x0);
  tile.mutable_window()->set_y0(window.y0);
  tile.mutable_window()->set_x1(window.x1);
  tile.mutable_window()->set_y1(window.y1);
  tile.mutable_tag()->set_revision(revision);
  tile.set_pass(pass);
  tile.set_samples_per_pixel(pass + 1);
  return tile;
}

}  // namespace helio::test
