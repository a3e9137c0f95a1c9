#include "renderer/frame/passes/measure.h"

namespace helio {

void MeasurePass::begin(const Film& film, const PixelRect& region) {
  estimate_ = std::make_shared<ErrorEstimate>(film, region);
  second_sweep_ = false;
  next_ = done_ = 0;
}

std::optional<MeasurePiece> MeasurePass::next() {
  if (!any_open()) return std::nullopt;
  return MeasurePiece{estimate_, second_sweep_, next_++};
}

void MeasurePass::finish(const MeasurePiece& piece) {
  if (piece.estimate != estimate_) return;  // stopped meanwhile
  ++done_;
  if (second_sweep_ || done_ < estimate_->parts()) return;
  estimate_->finish_look();
  second_sweep_ = true;
  next_ = done_ = 0;
}

void run_measure(const MeasurePiece& piece) {
  if (piece.second_sweep) {
    piece.estimate->add_up(piece.part);
  } else {
    piece.estimate->look_over(piece.part);
  }
}

}  // namespace helio
