// Stage: decides how many samples each pixel gets in the round that follows (film/allocation/sample_allocation.h).
#pragma once

#include <memory>
#include <optional>

#include "renderer/film/allocation/sample_allocation.h"
#include "renderer/frame/render_settings.h"
#include "renderer/frame/stage.h"

namespace helio {

// What the settings say of it; absent: every pixel gets the same number of samples.
std::optional<AllocationSettings> allocation_settings(const RenderSettings& settings);
// What a film needs for them.
FilmState film_state(const RenderSettings& settings);

class AllocateSamples final : public FrameStage {
 public:
  // mean: of the request that the allocation was made for; gaze_moves: FrameState::gaze_moves then. The film, which
  // outlives this, has targets.
  AllocateSamples(Film& film, double mean, std::uint64_t gaze_moves, std::unique_ptr<SampleAllocation> allocation);

  int sweeps() const override { return allocation_->sweeps(); }
  std::size_t parts() const override { return allocation_->parts(); }
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;
  void finished(TileGrid& grid) override;
  void note(PictureState& picture) override;

 private:
  Film& film_;
  double mean_;
  std::uint64_t gaze_moves_;
  std::unique_ptr<SampleAllocation> allocation_;
};

}  // namespace helio
