// Stage: puts the pixels of a checkpoint into the film and lets the picture go on from there
// (frame/picture_checkpoint.h). One that was stopped on the way is done again from its beginning.
#pragma once

#include <memory>

#include "renderer/frame/picture_checkpoint.h"
#include "renderer/frame/stage.h"

namespace helio {

class RestorePicture final : public FrameStage {
 public:
  // The film, which outlives this, and the region suit the checkpoint.
  RestorePicture(Film& film, std::shared_ptr<const PictureCheckpoint> checkpoint);

  int sweeps() const override { return 1; }
  std::size_t parts() const override { return checkpoint_->film().parts(); }
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;
  void finished(TileGrid& grid) override;
  void note(PictureState& picture) override;

 private:
  Film& film_;
  const std::shared_ptr<const PictureCheckpoint> checkpoint_;
  bool complete_ = false;
};

}  // namespace helio
