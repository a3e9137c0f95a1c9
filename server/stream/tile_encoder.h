// A resolved tile -> the EXR file, or of previews the JPEG file, that a listener asked for.
#pragma once

#include <string>
#include <utility>
#include <vector>

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
  std::size_t planes() const;  // of the channels, R, G and B included
};

// The same of a preview: three halves.
inline constexpr std::uint64_t kPreviewBytesPerPixel = 6;

// A tile of the frame. exposure, in stops, is used by previews as JPEG alone.
Result<EncodedTile> encode(const FrameTile& tile, int frame_width, int frame_height, const TileFormat& format,
                           double exposure = 0);

// A whole picture, put together from its tiles.
struct PicturePlanes {
  PixelRect window;
  std::vector<std::pair<const ChannelPlane*, std::vector<float>>> planes;  // window.area() values each, row-major

  PicturePlanes() = default;
  PicturePlanes(const PixelRect& window, unsigned channels);  // of zeros
  void put(const ResolvedTile& tile);                         // which lies in the window
};
// As encode() does with a tile's film.
Result<std::vector<std::uint8_t>> encode_picture(const PicturePlanes& picture, const TileHeader& header,
                                                 const TileEncoding& encoding);

}  // namespace helio
