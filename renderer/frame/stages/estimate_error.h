// Stage: estimates the error of the whole region from its two halves (film/estimate/error_estimate.h).
#pragma once

#include "renderer/film/estimate/error_estimate.h"
#include "renderer/frame/stage.h"

namespace helio {

class EstimateError final : public FrameStage {
 public:
  // The film outlives this.
  EstimateError(const Film& film, const PixelRect& region);

  int sweeps() const override { return estimate_.sweeps(); }
  std::size_t parts() const override { return estimate_.parts(); }
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;
  void note(PictureState& picture) override;

  // After the last sweep.
  FilmError result() const { return estimate_.result(); }

 private:
  ErrorEstimate estimate_;
};

}  // namespace helio
