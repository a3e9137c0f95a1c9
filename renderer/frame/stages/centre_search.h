// Pass: finds out what the pixels of the picture in hand show at their centres (trace/gbuffer/gbuffer_pass.h), where it
// began without knowing. The next camera move needs it, and would wait for it.
#pragma once

#include <utility>

#include "renderer/frame/stages/history_transfer.h"
#include "renderer/frame/stages/temporal_reprojection.h"
#include "renderer/trace/gbuffer/gbuffer_pass.h"

namespace helio {

class CentreSearch final : public TemporalReprojection {
 public:
  // The film, whose picture is in `history`, and that outlive this.
  CentreSearch(Film& film, const PixelRect& region, PictureHistory& history, const PixelFilter& filter)
      : history_(history),
        windows_(transfer_windows(region)),
        centres_(history.film_scene(), film, region, history.film_pose(), filter) {}

  std::size_t parts() const override { return windows_.size(); }
  int sweeps() const override { return 3; }
  void run(int sweep, std::size_t part) override {
    ReprojectionStats stats;
    if (sweep == 0) {
      stats.rays = centres_.find(windows_[part]);
    } else if (sweep == 1) {
      stats.rays = centres_.find_borders(windows_[part]);
    } else {
      centres_.settle(windows_[part]);
    }
    note(stats);
  }
  void finish_sweep(int sweep) override {
    if (sweep < 2) return;
    history_.centres_found();
    note_complete();
  }

 private:
  PictureHistory& history_;
  std::vector<PixelRect> windows_;
  GbufferPass centres_;
};

}  // namespace helio
