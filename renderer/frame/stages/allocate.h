// Pass: decides how many samples each pixel gets in the round that follows (film/allocation/sample_allocation.h).
#pragma once

#include <optional>

#include "renderer/film/allocation/sample_allocation.h"
#include "renderer/frame/stages/sweeps.h"
#include "renderer/frame/render_settings.h"

namespace helio {

// What the settings say of it; absent: every pixel gets the same number of samples.
std::optional<AllocationSettings> allocation_settings(const RenderSettings& settings);
// What a film needs for them.
FilmState film_state(const RenderSettings& settings);

using AllocatePiece = SweepPiece<SampleAllocation>;
using AllocatePass = SweepPass<SampleAllocation>;

}  // namespace helio
