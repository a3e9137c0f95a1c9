// Stage: makes a preview (preview/preview.h, preview/paper/paper_preview.h). Of a frame of its own, which the render loop begins in place of the film's.
#pragma once

#include <memory>
#include <utility>

#include "renderer/frame/frame_sink.h"
#include "renderer/frame/stage.h"
#include "renderer/frame/stages/resolve.h"
#include "renderer/preview/preview_history.h"
#include "renderer/preview/preview_maker.h"
#include "renderer/preview/preview_target.h"

namespace helio {

class PreviewStage final : public FrameStage {
 public:
  // history: made for what the target asks for, ours or as published.
  PreviewStage(std::shared_ptr<PreviewHistory> history, PreviewTarget target,
               std::shared_ptr<const CancelToken> cancel);

  int sweeps() const override { return preview_->sweeps(); }
  std::size_t parts() const override { return preview_->parts(); }
  void run(int sweep, std::size_t part, TraceStats& stats) override { preview_->run(sweep, part, stats); }
  void finish_sweep(int sweep) override { preview_->finish_sweep(sweep); }

  // A tile of the picture, once the stage is done. Thread safe.
  FrameTile resolve(const ResolvePiece& piece, const FrameTag& tag) const;

 private:
  std::unique_ptr<PreviewMaker> preview_;
};

}  // namespace helio
