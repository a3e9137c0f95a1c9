// Path tracing for films that keep first hits.
#pragma once

#include "renderer/trace/paths/path_integrator.h"

namespace helio {

// trace_window() of integrator `path`, in the same bits; where the film keeps first hits, notes them (hit_recorder.h).
bool trace_noting_hits(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                       const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                       TraceStats& stats, const SampleTargets* targets = nullptr,
                       const LightVertexCache* lights = nullptr);

}  // namespace helio
