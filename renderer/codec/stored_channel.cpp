#include "renderer/codec/stored_channel.h"

#include <cstring>

#include "renderer/codec/half_convert.h"

namespace helio {

void StoredChannel::write(std::size_t first, std::size_t count, char* out) const {
  if (type == TilePixelType::float32) {
    std::memcpy(out, values + first, count * value_bytes);
  } else {
    convert_to_half(values + first, count, keep_positive, out);
  }
}

}  // namespace helio
