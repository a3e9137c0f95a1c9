#include "renderer/frame/stages/allocate.h"

#include "renderer/film/core/sample_targets.h"
#include "renderer/frame/picture_state.h"
#include "renderer/frame/tile_grid.h"

namespace helio {

std::optional<AllocationSettings> allocation_settings(const RenderSettings& settings) {
  if (!allocates(settings.mode)) return std::nullopt;
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
  const bool paper = settings.variant == ModeVariant::paper;
  const bool history = reuses(settings.mode);
  return {.targets = allocates(settings.mode),
          .threshold = allocates(settings.mode) && paper,
          .history = history,
          .stored_hits = history && paper ? settings.reprojection.stored_hits : 0,
          .splats = traces_light_paths(settings.integrator) && settings.integrator != Integrator::photon,
          .merging = merges(settings.integrator)};
}

AllocateSamples::AllocateSamples(Film& film, const PixelRect& region, const AllocationSettings& settings,
                                 const AllocationRequest& request)
    : FrameStage(StageId::allocate),
      film_(film),
      mean_(request.mean),
      allocation_(make_allocation(film, region, settings, request)) {}

void AllocateSamples::run(int sweep, std::size_t part, TraceStats&) {
  allocation_->run(sweep, part);
}

void AllocateSamples::finish_sweep(int sweep) {
  allocation_->finish_sweep(sweep);
}

void AllocateSamples::finished(TileGrid& grid) {
  grid.begin_round(*film_.targets());
}

void AllocateSamples::note(PictureState& picture) {
  RoundState& round = picture.state.round;
  ++round.number;
  round.mean = mean_;
  round.summary = film_.targets()->round;
}

}  // namespace helio
