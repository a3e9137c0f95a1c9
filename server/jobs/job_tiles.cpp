#include "server/jobs/job_tiles.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "renderer/codec/checksum.h"
#include "renderer/frame/checkpoint/checkpoint_picture.h"

namespace helio {
namespace {

constexpr int kSide = 128;  // of a tile, aligned to the film

// The part of a decoded picture in this window, with those of the channels that it has.
PicturePlanes cut(const DecodedTile& picture, const PixelRect& window, unsigned channels) {
  PicturePlanes part(window, channels);
  const PixelRect& whole = picture.header.data_window;
  std::erase_if(part.planes, [&](const auto& plane) { return picture.find(plane.first->name) == nullptr; });
  for (auto& [plane, values] : part.planes) {
    const std::vector<float>& from = *picture.find(plane->name);
    for (int y = window.y0; y < window.y1; ++y) {
      const auto row = from.begin() + std::ptrdiff_t(y - whole.y0) * whole.width() + (window.x0 - whole.x0);
      std::copy_n(row, window.width(), values.begin() + std::ptrdiff_t(y - window.y0) * window.width());
    }
  }
  return part;
}

}  // namespace

JobTiles::JobTiles(const PixelRect& window) {
  for (int y = window.y0 / kSide * kSide; y < window.y1; y += kSide) {
    for (int x = window.x0 / kSide * kSide; x < window.x1; x += kSide)
      windows_.push_back(intersect(window, {x, y, x + kSide, y + kSide}));
  }
}

Result<JobTiles> JobTiles::of_file(std::span<const std::uint8_t> file, const Request& request) {
  const PixelRect region = request.settings.rendered_region();
  auto decoded = decode_tile(file, std::uint64_t(region.area()));
  if (!decoded) return decoded.error();
  if (decoded->header.data_window != region)
    return Error{ErrorCode::internal, "the view's file holds another part of the film than was rendered", "view"};
  JobTiles tiles(request.window);
  const auto picture = std::make_shared<const DecodedTile>(std::move(*decoded));
  tiles.make_ = [picture, request](const PixelRect& window) -> Result<EncodedTile> {
    const TileHeader header{window, request.settings.width, request.settings.height};
    auto bytes = encode_picture(cut(*picture, window, request.format.channels), header, request.format.encoding);
    if (!bytes) return bytes.error();
    EncodedTile tile;
    tile.window = window;
    tile.final = true;
    tile.bytes = std::move(*bytes);
    tile.crc32 = crc32_of(tile.bytes.data(), tile.bytes.size());
    return tile;
  };
  return tiles;
}

JobTiles JobTiles::of_checkpoint(const PictureCheckpoint& checkpoint, const Request& request) {
  JobTiles tiles(request.window);
  const auto picture = std::make_shared<const CheckpointPicture>(checkpoint, request.settings);
  tiles.make_ = [picture, request](const PixelRect& window) {
    return encode(picture->resolve(window, request.format.channels), request.settings.width, request.settings.height,
                  request.format);
  };
  return tiles;
}

Result<std::optional<EncodedTile>> JobTiles::next() {
  if (next_ == windows_.size()) return std::optional<EncodedTile>();
  auto tile = make_(windows_[next_++]);
  if (!tile) return tile.error();
  return std::optional<EncodedTile>(std::move(*tile));
}

}  // namespace helio
