// Stage: finds out what the pixels of the picture in hand show at their centres (trace/gbuffer/gbuffer_pass.h), where it
// began without knowing. The next camera move needs it, and would wait for it.
#pragma once

#include <atomic>
#include <vector>

#include "renderer/frame/stage.h"
#include "renderer/frame/stages/history_transfer.h"
#include "renderer/trace/gbuffer/gbuffer_pass.h"

namespace helio {

class CentreSearch final : public FrameStage {
 public:
  // The film, whose picture is in `history`, and that outlive this.
  CentreSearch(Film& film, const PixelRect& region, PictureHistory& history, const PixelFilter& filter);

  int sweeps() const override { return 3; }
  std::size_t parts() const override { return windows_.size(); }
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;
  void note(PictureState& picture) override;

 private:
  PictureHistory& history_;
  std::vector<PixelRect> windows_;
  GbufferPass centres_;
  std::atomic<std::uint64_t> rays_ = 0;
};

}  // namespace helio
