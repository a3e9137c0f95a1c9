// Stage: makes the display layer of the film as it is (film/display/display_layer.h).
#pragma once

#include "renderer/film/display/display_layer.h"
#include "renderer/frame/stage.h"

namespace helio {

class MakeDisplay final : public FrameStage {
 public:
  // The film and the layer, which are of one size, outlive this.
  MakeDisplay(const Film& film, const PixelRect& region, DisplayLayer& layer)
      : FrameStage(StageId::display), film_(film), layer_(layer) {
    layer_.begin(region);
  }

  int sweeps() const override { return DisplayLayer::kSweeps; }
  std::size_t parts() const override { return layer_.parts(); }
  void run(int sweep, std::size_t part, TraceStats&) override { layer_.run(film_, sweep, part); }
  void finish_sweep(int sweep) override { layer_.finish_sweep(sweep); }
  void note(PictureState& picture) override;

 private:
  const Film& film_;
  DisplayLayer& layer_;
};

}  // namespace helio
