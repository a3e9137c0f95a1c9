// The sink of a job that the daemon keeps: puts the final tiles of a view together, for its file.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "heliograph/v1/picture_origin.pb.h"
#include "renderer/frame/frame_sink.h"
#include "server/base/memory_account.h"
#include "server/stream/tile_encoder.h"

namespace helio {

namespace pb = heliograph::v1;

// Thread safe as far as the renderer calls; the members before the sink's are for one thread.
class JobPicture final : public FrameSink {
 public:
  // ended: called when a frame has come to its end, on the thread that says so.
  JobPicture(MemoryAccount& memory, const TileFormat& format, std::function<void()> ended);

  // The memory for pictures of this region. resource_exhausted: max_memory.
  Status reserve(const PixelRect& region);
  // How the newest frame of this revision ended; nothing: it has not.
  std::optional<FrameEnd> end(std::uint64_t revision);
  // The newest frame as an EXR file, whose `comments` are what its integrator leaves out. `origin` lacks what the frame
  // tells: settings and how it ended. Precondition: it has ended.
  Result<std::vector<std::uint8_t>> encode(pb::PictureOrigin origin);

  void frame_begun(const FrameBegin& begin) override;
  void tile_ready(FrameTile tile) override;
  void frame_ended(const FrameEnd& end) override;

 private:
  MemoryAccount& memory_;
  const TileFormat format_;
  const std::function<void()> ended_;

  std::mutex mutex_;
  FrameBegin begin_;
  std::optional<FrameEnd> end_;
  Reservation reserved_;  // for the planes
  PicturePlanes picture_;
};

}  // namespace helio
