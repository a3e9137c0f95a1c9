// A channel's values as they go into the file. Internal to the codec.
#pragma once

#include <memory>

#include "renderer/codec/tile_codec.h"

namespace helio {

inline constexpr const char* kExrSoftware = "Heliograph " HELIO_VERSION;

struct StoredChannel {
  const char* name = nullptr;
  TilePixelType type = TilePixelType::half;
  std::size_t value_bytes = 2;
  std::unique_ptr<std::uint16_t[]> halves;  // owns the values of a half channel
  const char* values = nullptr;             // row-major, native byte order
};

}  // namespace helio
