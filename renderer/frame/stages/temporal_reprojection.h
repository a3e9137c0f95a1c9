// Pass: brings what earlier pictures know into the film of a new camera, by one method or another.
#pragma once

#include <cstddef>
#include <mutex>
#include <vector>

#include "renderer/film/core/film_windows.h"
#include "renderer/frame/stages/sweeps.h"
#include "renderer/trace/reuse/reprojection.h"

namespace helio {

// The parts of sweeps over a region: about a millisecond each.
inline std::vector<PixelRect> transfer_windows(const PixelRect& region) {
  return cut_aligned(region, 16 * kFilmBlock, kFilmBlock);
}

// The sweeps of one move.
class TemporalReprojection {
 public:
  virtual ~TemporalReprojection() = default;
  virtual std::size_t parts() const = 0;
  virtual int sweeps() const = 0;
  virtual void run(int sweep, std::size_t part) = 0;
  virtual void finish_sweep(int sweep) = 0;

  // The film holds all of the new picture's beginning.
  bool complete() const { return complete_; }

  // Of what has been done so far. Thread safe.
  ReprojectionStats stats() const {
    const std::lock_guard lock(mutex_);
    return stats_;
  }

 protected:
  void note(const ReprojectionStats& stats) {
    const std::lock_guard lock(mutex_);
    stats_.add(stats);
  }
  void note_complete() { complete_ = true; }

 private:
  bool complete_ = false;
  mutable std::mutex mutex_;  // of stats_
  ReprojectionStats stats_;
};

using ReprojectPiece = SweepPiece<TemporalReprojection>;
using ReprojectPass = SweepPass<TemporalReprojection>;

}  // namespace helio
