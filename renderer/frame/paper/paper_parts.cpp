#include "renderer/frame/paper/paper_parts.h"

#include "renderer/frame/paper/forward_transfer.h"
#include "renderer/frame/paper/hit_tracing.h"
#include "renderer/frame/paper/paper_film.h"
#include "renderer/frame/paper/threshold_allocation.h"
#include "renderer/frame/stages/make_stage.h"

namespace helio {
namespace {

FilmState film_state(FilmState state, const RenderSettings& settings) {
  return paper_film_state(state, settings.reprojection.stored_hits);
}

std::unique_ptr<SampleAllocation> allocation(Film& film, const PixelRect& region, const RenderSettings& settings,
                                             const AllocationRequest& request) {
  const ThresholdSettings threshold{settings.adaptive.min_samples, settings.adaptive.max_samples, settings.seed};
  return std::make_unique<ThresholdAllocation>(film, region, threshold, request);
}

std::shared_ptr<TemporalReprojection> reprojection(const StageContext& c) {
  return std::make_shared<ForwardTransfer>(c.scene, c.film, c.grid.region(), c.history, c.camera, c.settings.filter,
                                           float(c.settings.reprojection.max_error));
}

}  // namespace

const VariantParts kPaperParts{film_state, trace_noting_hits, allocation, true, reprojection};

}  // namespace helio
