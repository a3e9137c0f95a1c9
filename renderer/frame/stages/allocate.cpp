#include "renderer/frame/stages/allocate.h"

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

}  // namespace helio
