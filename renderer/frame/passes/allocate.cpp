#include "renderer/frame/passes/allocate.h"

namespace helio {

std::optional<AllocationSettings> allocation_settings(const RenderSettings& settings) {
  if (settings.mode != RenderMode::adaptive) return std::nullopt;
  AllocationSettings allocation;
  allocation.paper = settings.variant == ModeVariant::paper;
  allocation.measure =
      settings.adaptive.measure == ErrorMeasure::rmse ? AllocationMeasure::absolute : AllocationMeasure::relative;
  allocation.min_samples = settings.adaptive.min_samples;
  allocation.max_samples = settings.adaptive.max_samples;
  allocation.seed = settings.seed;
  return allocation;
}

FilmState film_state(const RenderSettings& settings) {
  return allocation_settings(settings) ? FilmState::adaptive : FilmState::uniform;
}

void AllocatePass::finish(const AllocatePiece& piece) {
  if (piece.allocation != allocation_) return;  // stopped meanwhile
  if (++done_ < allocation_->parts()) return;
  allocation_->finish_sweep(sweep_++);
  done_ = 0;
  next_ = sweep_ < allocation_->sweeps() ? 0 : allocation_->parts();
}

}  // namespace helio
