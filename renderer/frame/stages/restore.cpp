#include "renderer/frame/stages/restore.h"

#include <utility>

#include "renderer/frame/picture_state.h"

namespace helio {

RestorePicture::RestorePicture(Film& film, std::shared_ptr<const PictureCheckpoint> checkpoint)
    : FrameStage(StageId::restore), film_(film), checkpoint_(std::move(checkpoint)) {}

void RestorePicture::run(int, std::size_t part, TraceStats&) {
  checkpoint_->film().load(checkpoint_->pixels(), part, film_);
}

void RestorePicture::finish_sweep(int) {
  write_film(checkpoint_->head(), film_);
}

void RestorePicture::finished(TileGrid& grid) {
  grid.set_progress(checkpoint_->head().cells);
  complete_ = true;
}

void RestorePicture::note(PictureState& picture) {
  if (!complete_) return;
  const PictureHead& head = checkpoint_->head();
  picture.samples = head.samples;
  picture.trace = head.trace;
  picture.state.measured = head.measured;
  picture.state.round = head.round;
  picture.state.round.published = 0;
  picture.state.round.gaze_moves = 0;  // of a gaze before those of this loop, where there is one
  picture.state.restore_due = false;
  picture.state.choice_due = false;
}

}  // namespace helio
