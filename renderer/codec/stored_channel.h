// A channel's values as they go into the file. Internal to the codec.
#pragma once

#include <cstddef>

#include "renderer/codec/tile_codec.h"

namespace helio {

inline constexpr const char* kExrSoftware = "Heliograph " HELIO_VERSION;

struct StoredChannel {
  const char* name = nullptr;
  TilePixelType type = TilePixelType::half;
  std::size_t value_bytes = 2;
  bool keep_positive = false;     // TileChannel's
  const float* values = nullptr;  // row-major

  // Values [first, first + count), in native byte order: count * value_bytes bytes.
  void write(std::size_t first, std::size_t count, char* out) const;
};

}  // namespace helio
