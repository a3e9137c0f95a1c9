// The first frame after a camera move with integrators that cache light vertices, and rates of bidirectional samples.
#pragma once

#include "renderer/frame/render_loop.h"
#include "tests/bench/bench_context.h"
#include "tests/bench/reports/figures.h"

namespace helio::bench {

// KIND.first_frame.INTEGRATOR: seconds of a first frame (one sample a pixel) that traces its light paths over those of
// the same one that draws on the light paths of the view before. Medians, in turns.
Status add_first_frames(BenchContext& context, RenderEngine& engine, Figures& figures);

// cornell.bdpt.samples_per_second, and over what pbrt-v4 and SmallVCM do on such machines.
Status add_bidirectional_rate(BenchContext& context, RenderEngine& engine, Figures& figures);

}  // namespace helio::bench
