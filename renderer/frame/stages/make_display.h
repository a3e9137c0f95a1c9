// Stage: makes the display layer of the film as it is (film/display/display_layer.h).
//
// By Open Image Denoise it is one part that takes long, with threads of the library's own beside it, and ends soon
// after the frame is cancelled.
#pragma once

#include <memory>
#include <utility>

#include "renderer/base/cancel.h"
#include "renderer/film/display/display_layer.h"
#include "renderer/frame/stage.h"

namespace helio {

class MakeDisplay final : public FrameStage {
 public:
  // The film and the layer, which are of one size, outlive this.
  MakeDisplay(const Film& film, const PixelRect& region, DisplayLayer& layer, std::shared_ptr<const CancelToken> cancel)
      : FrameStage(StageId::display), film_(film), layer_(layer), cancel_(std::move(cancel)) {
    layer_.begin(region);
  }

  int sweeps() const override { return layer_.sweeps(); }
  std::size_t parts() const override { return layer_.parts(); }
  void run(int sweep, std::size_t part, TraceStats&) override { layer_.run(film_, sweep, part, cancel_.get()); }
  void finish_sweep(int sweep) override { layer_.finish_sweep(sweep); }
  void note(PictureState& picture) override;

 private:
  const Film& film_;
  DisplayLayer& layer_;
  const std::shared_ptr<const CancelToken> cancel_;  // of the frame
};

}  // namespace helio
