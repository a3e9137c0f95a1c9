// A resolved tile -> the EXR that a listener asked for.
#pragma once

#include "renderer/base/result.h"
#include "renderer/codec/tile_codec.h"
#include "renderer/frame/frame_sink.h"
#include "server/stream/outbound_queue.h"

namespace helio {

struct TileFormat {
  TileEncoding encoding;
  unsigned channels = kResolveVariance | kResolveSamples;  // ResolveChannels beside R, G, B

  // Upper bound of the pixel data of one pixel, uncompressed.
  std::uint64_t bytes_per_pixel() const;
};

// Of a pixel of a preview, at most.
inline constexpr std::uint64_t kPreviewBytesPerPixel = 6;

Result<EncodedTile> encode(const FrameTile& tile, int frame_width, int frame_height, const TileFormat& format);

}  // namespace helio
