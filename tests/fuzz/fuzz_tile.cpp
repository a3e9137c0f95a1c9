// Tiles as a client gets them from a daemon that it need not trust.
#include <cstdlib>

#include "renderer/codec/tile_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint64_t kMaxPixels = 64 * 64;
  const auto tile = helio::decode_tile({data, size}, kMaxPixels);
  if (!tile) {
    if (tile.error().message.empty()) std::abort();
    return 0;
  }
  const auto area = std::uint64_t(tile->header.data_window.area());
  if (area > kMaxPixels || tile->names.size() != tile->channels.size()) std::abort();
  for (const auto& channel : tile->channels) {
    if (channel.size() != area) std::abort();
  }
  return 0;
}
