// The seam between the frame machinery and what turns samples into radiance.
#pragma once

#include <functional>

#include "renderer/base/cancel.h"
#include "renderer/film/core/film.h"
#include "renderer/frame/render_settings.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

// Samples [range.first, range.first + range.count) of one half, for every pixel of the window; with targets, for those
// that take part in them.
struct IntegrateJob {
  CameraPose camera;
  RenderSettings settings;
  SampleRange range;
  PixelRect window;
  const SampleTargets* targets = nullptr;
  const LightVertexCache* lights = nullptr;  // where the integrator asks for it
};

// Adds the job's samples to the film in index order, or leaves the film as it was and returns false when `cancel` was
// raised on the way (it is polled often: a cancel must take effect within a few milliseconds). Called from several
// workers at once, for disjoint windows. Throwing ends the frame as failed, with the exception's message.
using IntegrateFunction =
    std::function<bool(const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats)>;

// The path tracer's part of the settings.
PathSettings path_settings(const RenderSettings& settings);

// trace_window() on a scene, or what the settings' variant has in its place.
IntegrateFunction path_tracer(std::shared_ptr<const RenderScene> scene);

}  // namespace helio
