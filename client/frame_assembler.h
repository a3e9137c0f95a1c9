// Puts the EXR tiles of one frame, of the film or of a preview, together, believing none of them unchecked.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "client/picture.h"
#include "heliograph/v1/types.pb.h"
#include "renderer/base/result.h"

namespace helio {

// Not thread safe: feed it from the callbacks of one stream or job.
class FrameAssembler {
 public:
  // Starts a frame of settings.width x height, limited to settings.region when given; what was there is forgotten.
  // invalid_argument: sizes or region that no server may announce.
  Status begin(const heliograph::v1::RenderSettings& settings);
  // As above; tiles of another revision are refused from the start, and so are those of a preview in a frame of the
  // film and the reverse. (A job's tiles carry the revision of their view, which the first one tells, and are the
  // film's.)
  Status begin(const heliograph::v1::FrameBegin& frame);

  enum class Outcome {
    taken,  // part of the picture now
    stale,  // of an older revision, or an older pass than what is there already: ignored, counted
  };
  // Checks revision, window (inside the frame's region) and checksum, and keeps the bytes. Errors are about a broken
  // tile, or one that has a JPEG in place of an EXR (internal): the picture stays as it was.
  Result<Outcome> add(heliograph::v1::Tile tile);

  // Decodes what came since the last call and returns the picture so far; pixels that no tile covered are 0 in every
  // channel. internal: a tile that is no EXR of the announced window and frame, or whose channels differ from the
  // other tiles'. Valid until the next call of a member.
  Result<const Picture*> picture();

  std::uint64_t tiles() const { return tiles_; }
  std::uint64_t stale_tiles() const { return stale_; }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t invalid_samples() const;    // NaN or infinite samples left out of the tiles shown
  bool complete() const;                    // every pixel of the region is covered
  bool final() const;                       // and by final tiles only
  std::uint32_t samples_per_pixel() const;  // smallest over the tiles shown; 0 while incomplete

 private:
  struct Slot {
    PixelRect window;
    std::uint32_t pass = 0;
    std::uint32_t samples_per_pixel = 0;
    std::uint64_t invalid_samples = 0;
    bool final = false;
    std::string pending;  // EXR bytes not decoded yet
  };

  Status decode(Slot& slot);
  Slot* find(const PixelRect& window);
  bool overlaps_another(const PixelRect& window) const;

  Picture picture_;
  bool preview_ = false;
  bool revision_known_ = false;
  std::uint64_t revision_ = 0;
  std::vector<Slot> slots_;                               // disjoint windows
  std::map<std::pair<int, int>, std::size_t> by_corner_;  // (x0, y0) -> index into slots_
  std::int64_t covered_ = 0;                              // pixels
  std::uint64_t tiles_ = 0, stale_ = 0, bytes_ = 0;
};

}  // namespace helio
