#include "renderer/frame/stages/make_stage.h"

#include <utility>

#include "renderer/base/check.h"
#include "renderer/frame/stages/allocate.h"
#include "renderer/frame/stages/checkpoint.h"
#include "renderer/frame/stages/choose_integrators.h"
#include "renderer/frame/stages/estimate_error.h"
#include "renderer/frame/stages/make_display.h"
#include "renderer/frame/stages/reject_history.h"
#include "renderer/frame/stages/restore.h"
#include "renderer/frame/variant_parts.h"

namespace helio {
namespace {

std::shared_ptr<FrameStage> make_reprojection(const StageRequest& request, const StageContext& c) {
  const RenderSettings& settings = c.settings;
  if (c.picture.state.transfer_prepared) {
    c.picture.transfer->resume(c.grid, request.first_samples);
    return c.picture.transfer;
  }
  if (const VariantParts* variant = variant_parts(settings)) {
    c.picture.transfer = variant->reprojection(c);
  } else {
    const double samples = double(c.picture.left_samples) / double(c.grid.region().area());
    c.picture.transfer = std::make_shared<HistoryTransfer>(c.scene, c.film, c.grid.region(), c.history, c.camera,
                                                           settings.filter, samples, path_settings(settings));
  }
  return c.picture.transfer;
}

std::shared_ptr<FrameStage> make_allocate(const AllocationRequest& request, const StageContext& c) {
  const VariantParts* variant = variant_parts(c.settings);
  std::unique_ptr<SampleAllocation> allocation;
  if (variant) {
    allocation = variant->allocation(c.film, c.grid.region(), c.settings, request);
  } else {
    AllocationSettings settings = *allocation_settings(c.settings);
    settings.density = c.density;
    allocation = make_allocation(c.film, c.grid.region(), settings, request);
  }
  return std::make_shared<AllocateSamples>(c.film, request.mean, c.picture.state.gaze_moves, std::move(allocation));
}

}  // namespace

std::shared_ptr<FrameStage> make_stage(const StageRequest& request, const StageContext& c) {
  switch (request.id) {
    case StageId::reproject:
      return make_reprojection(request, c);
    case StageId::choose:
      return std::make_shared<ChooseIntegrators>(c.scene, c.camera, path_settings(c.settings), c.cancel, c.film,
                                                 c.techniques);
    case StageId::allocate:
      return make_allocate(request.allocation, c);
    case StageId::review:
      return std::make_shared<RejectHistory>(c.film, c.grid.region());
    case StageId::measure:
      return std::make_shared<EstimateError>(c.film, c.grid.region());
    case StageId::display:
      HELIO_CHECK(c.display);
      return std::make_shared<MakeDisplay>(c.film, c.grid.region(), *c.display, c.cancel);
    case StageId::checkpoint:
      HELIO_CHECK(c.checkpoints && c.checkpoints->memory());
      return std::make_shared<MakeCheckpoint>(c, *c.checkpoints);
    case StageId::restore:
      HELIO_CHECK(c.picture.resume);
      return std::make_shared<RestorePicture>(c.film, c.picture.resume);
    case StageId::preview:
    case StageId::trace_lights:
    case StageId::integrate:
    case StageId::resolve:
      break;
  }
  HELIO_CHECK(false && "the pipeline or the loop does this by itself");
  return nullptr;
}

FrameStages make_stages(const FramePlan& plan, const StageContext& context) {
  FrameStages stages;
  for (const StageRequest& request : plan.before) stages.before.push_back(make_stage(request, context));
  for (const StageRequest& request : plan.after) stages.after.push_back(make_stage(request, context));
  return stages;
}

}  // namespace helio
