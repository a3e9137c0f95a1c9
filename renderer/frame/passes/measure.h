// Pass: estimates the error of the whole region from its two halves, in two sweeps over the film.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "renderer/film/error_estimate.h"

namespace helio {

struct MeasurePiece {
  std::shared_ptr<ErrorEstimate> estimate;
  bool second_sweep = false;
  std::size_t part = 0;
};

class MeasurePass {
 public:
  // Not thread safe: the owner's lock guards it.

  void begin(const Film& film, const PixelRect& region);
  std::optional<MeasurePiece> next();
  bool any_open() const { return estimate_ && next_ < estimate_->parts(); }
  void finish(const MeasurePiece& piece);
  void stop() { estimate_.reset(); }
  // Nothing was begun, or all of it is done.
  bool finished() const { return !estimate_ || (second_sweep_ && done_ == estimate_->parts()); }
  // Precondition: begun and finished.
  FilmError result() const { return estimate_->result(); }

 private:
  std::shared_ptr<ErrorEstimate> estimate_;
  bool second_sweep_ = false;
  std::size_t next_ = 0, done_ = 0;  // parts of the sweep
};

// Thread safe for pieces of one estimate.
void run_measure(const MeasurePiece& piece);

}  // namespace helio
