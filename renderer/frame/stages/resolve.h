// Stage: turns tiles of the film into what the sink gets.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "renderer/film/display/display_layer.h"
#include "renderer/frame/frame_plan.h"
#include "renderer/frame/frame_sink.h"
#include "renderer/frame/tile_grid.h"

namespace helio {

struct ResolvePiece {
  std::uint32_t tile = 0;
  PixelRect window;
  PixelRect roi;  // what may be read: with Publish::early the tile itself, because its neighbours are being written
  std::uint32_t samples_per_pixel = 0;
  std::uint32_t round = 0;
  bool final = false;
};

class ResolvePass {
 public:
  // Not thread safe: the owner's lock guards it.

  void begin_frame(std::size_t tiles);
  // Publish::round queues every tile that has not had its final publication; the others wait for tile_ready().
  void begin(const FramePlan& plan, const TileGrid& grid);
  // Publish::early: the tile has reached the plan's target.
  void tile_ready(std::uint32_t tile) { waiting_.push_back(tile); }
  std::optional<ResolvePiece> next(const TileGrid& grid);
  bool any_open() const { return next_ < waiting_.size(); }
  void finish() { --in_flight_; }
  void stop() {
    waiting_.clear();
    next_ = 0;
  }
  bool finished() const { return in_flight_ == 0 && !any_open(); }

  bool all_final() const { return final_tiles_ == tile_final_.size(); }

 private:
  Publish publish_ = Publish::none;
  bool final_ = false;
  std::uint32_t mean_samples_ = 0;
  std::uint32_t round_ = 0, rounds_ = 0;
  std::vector<std::uint32_t> waiting_;
  std::size_t next_ = 0;
  int in_flight_ = 0;
  std::vector<bool> tile_final_;
  std::size_t final_tiles_ = 0;
};

// Thread safe while nothing writes to piece.roi of the film. `mean_samples` as resolve_tile() has it.
// display: null where there is none; tiles that ask for it then show the film there.
FrameTile run_resolve(const ResolvePiece& piece, const FrameTag& tag, unsigned channels, double mean_samples,
                      const Film& film, const DisplayLayer* display);

}  // namespace helio
