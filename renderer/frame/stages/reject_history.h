// Stage: takes back what fresh samples contradict of the history that pixels carry
// (film/history/history_rejection.h).
#pragma once

#include "renderer/film/history/history_rejection.h"
#include "renderer/frame/stage.h"

namespace helio {

class RejectHistory final : public FrameStage {
 public:
  // The film, which has history, outlives this.
  RejectHistory(Film& film, const PixelRect& region);

  int sweeps() const override { return rejection_.sweeps(); }
  std::size_t parts() const override { return rejection_.parts(); }
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;
  void note(PictureState& picture) override;

 private:
  HistoryRejection rejection_;
};

}  // namespace helio
