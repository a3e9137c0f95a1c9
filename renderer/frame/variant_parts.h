// Hooks by which a variant other than `bounded` (RenderSettings::variant) replaces parts of the modes. The only one is
// `paper`, in frame/paper/, which variant_parts.cpp alone includes.
#pragma once

#include <memory>

#include "renderer/film/allocation/sample_allocation.h"
#include "renderer/frame/render_settings.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

class TemporalReprojection;
struct StageContext;

struct VariantParts {
  // Changes the film's state from what `bounded` would keep to what the variant keeps.
  FilmState (*film_state)(FilmState state, const RenderSettings& settings);
  // Integrator `path`.
  decltype(trace_window)* trace;
  // Modes that allocate. Preconditions: those of make_allocation().
  std::unique_ptr<SampleAllocation> (*allocation)(Film& film, const PixelRect& region, const RenderSettings& settings,
                                                  const AllocationRequest& request);
  bool allocation_iterates;  // AllocationSettings::iterates
  // Modes that reuse pictures; the stage `reproject`.
  std::shared_ptr<TemporalReprojection> (*reprojection)(const StageContext& context);
};

// Null: ours, or a mode that has no variants.
const VariantParts* variant_parts(const RenderSettings& settings);

}  // namespace helio
