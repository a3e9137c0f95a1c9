#include "renderer/frame/integrate_function.h"

#include <utility>

#include "renderer/trace/camera.h"

namespace helio {

IntegrateFunction path_tracer(std::shared_ptr<const RenderScene> scene) {
  return [scene = std::move(scene)](const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) {
    const Camera camera(job.camera, job.settings.width, job.settings.height, scene->origin());
    PathSettings path;
    path.seed = job.settings.seed;
    path.max_segments = job.settings.max_segments;
    path.roulette_from = job.settings.roulette_from;
    path.roulette = job.settings.roulette;
    return trace_window(*scene, camera, path, job.range, job.window, cancel, film, stats);
  };
}

}  // namespace helio
