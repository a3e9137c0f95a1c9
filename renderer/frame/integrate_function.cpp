#include "renderer/frame/integrate_function.h"

#include <utility>

#include "renderer/frame/variant_parts.h"
#include "renderer/trace/camera/camera.h"

namespace helio {

PathSettings path_settings(const RenderSettings& settings) {
  PathSettings path;
  path.seed = settings.seed;
  path.max_segments = settings.max_segments;
  path.roulette_from = settings.roulette_from;
  path.roulette = settings.roulette;
  path.integrator = settings.integrator;
  path.light_cache = settings.light_cache;
  path.technique = settings.technique;
  path.region = settings.rendered_region();
  return path;
}

IntegrateFunction path_tracer(std::shared_ptr<const RenderScene> scene) {
  return [scene = std::move(scene)](const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) {
    const Camera camera(job.camera, job.settings.width, job.settings.height, scene->origin(), job.settings.filter);
    const VariantParts* variant = variant_parts(job.settings);
    const auto trace = variant ? variant->trace : &trace_window;
    return trace(*scene, camera, path_settings(job.settings), job.range, job.window, cancel, film, stats, job.targets,
                 job.lights);
  };
}

}  // namespace helio
