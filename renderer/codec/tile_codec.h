// A tile on the wire: a complete EXR file whose data window lies in the frame's display window.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/result.h"

namespace helio {

enum class TileCompression { none, rle, zips, zip, piz, dwaa };
enum class TilePixelType { half, float32 };

// One channel of a tile: `data` holds window.area() floats, row-major, top row first.
struct TileChannel {
  std::string name;  // "R", "variance.G", "samples", "Z", ...
  const float* data = nullptr;
  // Channels whose values do not fit half (samples above 2048, depth) are always written as float.
  bool keep_float = false;
  // Positive values below the smallest half (6e-8) are written as that, not as 0: a variance must not become certainty.
  bool keep_positive = false;
};

// PictureOrigin of proto/heliograph/v1/picture_origin.proto.
inline constexpr const char* kExrOrigin = "heliograph.render";

struct TileHeader {
  PixelRect data_window;                  // in pixels of the frame
  int frame_width = 0, frame_height = 0;  // display window [0, width) x [0, height)
  std::string comments{};                 // the attribute of that name, for people to read; empty: none
  std::string origin{};                   // the attribute kExrOrigin: how the picture was made, as JSON; empty: none
};

struct TileEncoding {
  TilePixelType pixel_type = TilePixelType::half;
  TileCompression compression = TileCompression::none;
};

// Values too large for half, infinities included, are clamped to +-65504; NaN is written as it is. float32 and
// keep_float channels are written bit for bit. Names are unique, 1 to 255 bytes; the data window is not empty and lies
// in the display window: invalid_argument otherwise. dwaa is lossy for channels whose name ends in R, G or B.
Result<std::vector<std::uint8_t>> encode_tile(const TileHeader& header, std::span<const TileChannel> channels,
                                              const TileEncoding& encoding);

struct DecodedTile {
  TileHeader header;
  std::vector<std::string> names;
  std::vector<std::vector<float>> channels;  // as names, each data_window.area() floats

  const std::vector<float>* find(std::string_view name) const;
};

// Any EXR scanline file (one part, flat, no subsampling, at most 64 channels, every chunk present) within the limits;
// invalid_argument with the reason otherwise. `max_pixels` bounds the data window's area, and with it what is
// allocated, before it is allocated. Windows are given relative to the display window's corner; a data window that
// reaches out of the display window is kept as it is.
Result<DecodedTile> decode_tile(std::span<const std::uint8_t> bytes, std::uint64_t max_pixels);

// Writes a whole picture (data window = display window) to disk, atomically (temporary file, then rename).
Status write_exr(const std::string& path, const TileHeader& header, std::span<const TileChannel> channels,
                 const TileEncoding& encoding);
Result<DecodedTile> read_exr(const std::string& path, std::uint64_t max_pixels);

}  // namespace helio
