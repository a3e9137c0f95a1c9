#include "renderer/frame/stages/allocate.h"

#include <utility>

#include "renderer/film/core/sample_targets.h"
#include "renderer/frame/picture_state.h"
#include "renderer/frame/tile_grid.h"
#include "renderer/frame/variant_parts.h"

namespace helio {

std::optional<AllocationSettings> allocation_settings(const RenderSettings& settings) {
  if (!counts_differ(settings)) return std::nullopt;
  AllocationSettings allocation;
  const VariantParts* variant = variant_parts(settings);
  allocation.iterates = variant && variant->allocation_iterates;
  allocation.measure =
      settings.adaptive.measure == ErrorMeasure::rmse ? AllocationMeasure::absolute : AllocationMeasure::relative;
  allocation.by_noise = allocates(settings.mode);
  allocation.min_samples = allocation.by_noise ? settings.adaptive.min_samples : kHalves;
  allocation.seed = settings.seed;
  return allocation;
}

FilmState film_state(const RenderSettings& settings) {
  const FilmState state{.targets = counts_differ(settings),
                        .history = reuses(settings.mode),
                        .splats = traces_light_paths(settings.integrator) && settings.integrator != Integrator::photon,
                        .merging = merges(settings.integrator)};
  const VariantParts* variant = variant_parts(settings);
  return variant ? variant->film_state(state, settings) : state;
}

AllocateSamples::AllocateSamples(Film& film, double mean, std::uint64_t gaze_moves,
                                 std::unique_ptr<SampleAllocation> allocation)
    : FrameStage(StageId::allocate),
      film_(film),
      mean_(mean),
      gaze_moves_(gaze_moves),
      allocation_(std::move(allocation)) {}

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
  round.gaze_moves = gaze_moves_;
  round.summary = film_.targets()->round;
}

}  // namespace helio
