#include "renderer/frame/paper/hit_tracing.h"

#include "renderer/frame/paper/hit_recorder.h"
#include "renderer/trace/integrators/path_kernel_general.h"
#include "renderer/trace/integrators/path_kernel_lambert.h"

namespace helio {

bool trace_noting_hits(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                       const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                       TraceStats& stats, const SampleTargets* targets, const LightVertexCache* lights) {
  if (!paper_film(film).first_hits())
    return trace_window(scene, camera, settings, range, window, cancel, film, stats, targets, lights);
  const PixelRect rect = intersect(window, film.bounds());
  if (rect.empty() || range.count == 0) return !cancel.cancelled();
  const WindowTask task{scene.impl(), camera, settings, range, rect, cancel, film, nullptr, targets};
  const bool plain = has_plain_kernel(scene.features()) && !settings.general_kernel;
  return plain ? LambertKernel<HitRecorder>(task).run(stats) : GeneralKernel<HitRecorder>(task).run(stats);
}

}  // namespace helio
