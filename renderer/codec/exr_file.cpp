#include "renderer/codec/atomic_file.h"
#include "renderer/codec/tile_codec.h"

namespace helio {
namespace {

// A file of max_pixels pixels is no longer than this many bytes for each: 64 channels of 4 bytes.
constexpr std::uint64_t kBytesPerPixel = 256;
constexpr std::uint64_t kHeaderBytes = 16u << 20;

Error at(const std::string& path, Error error) {
  error.where = error.where.empty() ? path : path + ": " + error.where;
  return error;
}

}  // namespace

Status write_exr(const std::string& path, const TileHeader& header, std::span<const TileChannel> channels,
                 const TileEncoding& encoding) {
  const PixelRect whole{0, 0, header.frame_width, header.frame_height};
  if (header.data_window != whole) {
    return Error{ErrorCode::invalid_argument, "the data window must be the whole display window", path};
  }
  Result<std::vector<std::uint8_t>> bytes = encode_tile(header, channels, encoding);
  if (!bytes) return at(path, bytes.error());
  return write_file_atomically(path, *bytes);
}

Result<DecodedTile> read_exr(const std::string& path, std::uint64_t max_pixels) {
  const std::uint64_t pixels = std::min<std::uint64_t>(max_pixels, std::uint64_t(1) << 48);
  Result<std::vector<std::uint8_t>> bytes = read_whole_file(path, pixels * kBytesPerPixel + kHeaderBytes);
  if (!bytes) return bytes.error();
  Result<DecodedTile> tile = decode_tile(*bytes, max_pixels);
  if (!tile) return at(path, tile.error());
  return tile;
}

}  // namespace helio
