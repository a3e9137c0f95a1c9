// The picture of a job's view as tiles, for clients that show it (GetResult with `tiles`).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/frame/picture_checkpoint.h"
#include "server/base/memory_account.h"
#include "server/stream/tile_encoder.h"

namespace helio {

class JobTiles {
 public:
  // What is asked for; the window lies in the settings' rendered region.
  struct Request {
    RenderSettings settings;
    TileFormat format;
    PixelRect window;
  };
  // From the bytes of a view's EXR file; channels that it has not are left out. Errors: those of decode_tile();
  // internal: the file is another picture's.
  static Result<JobTiles> of_file(std::span<const std::uint8_t> file, const Request& request);
  // From a picture in hand.
  static JobTiles of_checkpoint(const PictureCheckpoint& checkpoint, const Request& request);

  // Counted until the tiles are gone.
  void count(Reservation memory) { memory_ = std::move(memory); }
  // The next tile, of at most 128x128 pixels; nothing: that was the last one.
  Result<std::optional<EncodedTile>> next();

 private:
  explicit JobTiles(const PixelRect& window);

  Reservation memory_;
  std::vector<PixelRect> windows_;
  std::size_t next_ = 0;
  std::function<Result<EncodedTile>(const PixelRect& window)> make_;
};

}  // namespace helio
