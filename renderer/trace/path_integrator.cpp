#include "renderer/trace/path_integrator.h"

#include <array>
#include <limits>

#include "renderer/trace/path_kernel.h"

namespace helio {

void TraceStats::add(const TraceStats& other) {
  if (invalid_samples == 0 && other.invalid_samples > 0) first_invalid = other.first_invalid;
  paths += other.paths;
  rays += other.rays;
  shadow_rays += other.shadow_rays;
  invalid_samples += other.invalid_samples;
}

void RayLog::add(const Ray* first, const std::uint32_t* order, std::size_t count, bool occlusion) {
  batches.push_back({occlusion, std::uint32_t(count)});
  for (std::size_t i = 0; i < count; ++i) rays.push_back(first[order ? order[i] : i]);
}

bool trace_window(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                  const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                  TraceStats& stats) {
  return trace_window_logged(scene, camera, settings, range, window, cancel, film, stats, nullptr);
}

bool trace_window_logged(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                         const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                         TraceStats& stats, RayLog* log) {
  const PixelRect rect = intersect(window, film.bounds());
  if (rect.empty() || range.count == 0) return !cancel.cancelled();
  const WindowTask task{scene.impl(), camera, settings, range, rect, cancel, film, log};
  // Two kernels: the general one, and the one for scenes of flat Lambert triangles. helio_bench features says what the
  // second earns.
  const SceneFeatures& f = scene.features();
  const bool plain = f.only_lambert && !f.textures && !f.normal_maps && !f.vertex_colors && !f.instances &&
                     !f.spheres && !f.smooth_normals && !f.absorption;
  return plain && !settings.general_kernel ? run_plain_kernel(task, stats) : run_general_kernel(task, stats);
}

}  // namespace helio
