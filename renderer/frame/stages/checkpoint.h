// Stage: copies the picture into a checkpoint, and hands that over (frame/picture_checkpoint.h). Between two plans, so
// that every sample is in the film whole.
#pragma once

#include <functional>
#include <memory>

#include "renderer/frame/checkpoint/checkpoint_maker.h"
#include "renderer/frame/stage.h"

namespace helio {

struct StageContext;

class MakeCheckpoint final : public FrameStage {
 public:
  // Notes all but the pixels at once.
  MakeCheckpoint(const StageContext& context, CheckpointMaker& maker);

  int sweeps() const override { return 1; }
  std::size_t parts() const override { return memory_->checkpoint.film().parts(); }
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;

 private:
  Film& film_;
  const std::shared_ptr<CheckpointMaker::Memory> memory_;
  const std::function<void()> keep_;
};

}  // namespace helio
