// Stage: brings what earlier pictures know into the film of a new camera, by one method or another.
#pragma once

#include <atomic>
#include <mutex>
#include <vector>

#include "renderer/film/core/film_windows.h"
#include "renderer/frame/stage.h"
#include "renderer/trace/reuse/reprojection.h"

namespace helio {

// The parts of sweeps over a region: about a millisecond each.
inline std::vector<PixelRect> transfer_windows(const PixelRect& region) {
  return cut_aligned(region, 16 * kFilmBlock, kFilmBlock);
}

// The sweeps of one move.
class TemporalReprojection : public FrameStage {
 public:
  TemporalReprojection() : FrameStage(StageId::reproject) {}

  void finished(TileGrid& grid) override;

  // A stage that has told what is to be expected before it has touched the film (FrameState::transfer_prepared): the
  // rest is a stage of another plan. first_samples: sample targets ask for one sample where nothing is carried.
  virtual void resume(const TileGrid& grid, bool first_samples) {
    (void)grid;
    (void)first_samples;
  }

  // The film holds all of the new picture's beginning. Thread safe, as is stats().
  bool complete() const { return complete_; }
  // Of what has been done so far.
  ReprojectionStats stats() const {
    const std::lock_guard lock(mutex_);
    return stats_;
  }

 protected:
  void add_stats(const ReprojectionStats& stats) {
    const std::lock_guard lock(mutex_);
    stats_.add(stats);
  }
  void note_complete() { complete_ = true; }

 private:
  std::atomic<bool> complete_ = false;
  mutable std::mutex mutex_;  // of stats_
  ReprojectionStats stats_;
};

}  // namespace helio
