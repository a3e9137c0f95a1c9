// A resolved tile -> the EXR file, or of previews the JPEG file, that a listener asked for.
#pragma once

#include "renderer/base/result.h"
#include "renderer/codec/tile_codec.h"
#include "renderer/frame/frame_sink.h"
#include "server/stream/outbound_queue.h"

namespace helio {

struct TileFormat {
  TileEncoding encoding;
  unsigned channels = kResolveVariance | kResolveSamples;  // ResolveChannels beside R, G, B

  int preview_jpeg = 0;    // quality of previews as JPEG, [1, 100]; 0: as EXR
  int variance_every = 1;  // of the tiles sent of one place in a frame, only each n-th has the variance

  // Upper bound of the pixel data of one pixel of the film, uncompressed.
  std::uint64_t bytes_per_pixel() const;
};

// The same of a preview: three halves.
inline constexpr std::uint64_t kPreviewBytesPerPixel = 6;

// A tile of the frame. exposure, in stops, is used by previews as JPEG alone.
Result<EncodedTile> encode(const FrameTile& tile, int frame_width, int frame_height, const TileFormat& format,
                           double exposure = 0);

}  // namespace helio
