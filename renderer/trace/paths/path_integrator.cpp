#include "renderer/trace/paths/path_integrator.h"

#include <array>
#include <limits>
#include <tuple>

#include "renderer/base/check.h"
#include "renderer/trace/paths/path_kernel.h"

namespace helio {

namespace {

bool comes_before(const InvalidSample& a, const InvalidSample& b) {
  return std::tie(a.index, a.half, a.y, a.x, a.light_path) < std::tie(b.index, b.half, b.y, b.x, b.light_path);
}

void note_first(const InvalidSample& sample, TraceStats& stats) {
  if (stats.invalid() == 0 || comes_before(sample, stats.first_invalid)) stats.first_invalid = sample;
}

}  // namespace

void TraceStats::note_invalid(const InvalidSample& sample) {
  note_first(sample, *this);
  ++invalid_samples;
}

void TraceStats::note_invalid_splat(bool finite, const InvalidSample& sample) {
  note_first(sample, *this);
  ++invalid_splats;
  bright_splats += finite;
}

void TraceStats::add(const TraceStats& other) {
  if (other.invalid() > 0) note_first(other.first_invalid, *this);
  paths += other.paths;
  light_paths += other.light_paths;
  rays += other.rays;
  shadow_rays += other.shadow_rays;
  invalid_samples += other.invalid_samples;
  invalid_splats += other.invalid_splats;
  bright_splats += other.bright_splats;
  media_overflows += other.media_overflows;
  dropped += other.dropped;
}

void RayLog::add(const Ray* first, const std::uint32_t* order, std::size_t count, bool occlusion) {
  batches.push_back({occlusion, std::uint32_t(count)});
  for (std::size_t i = 0; i < count; ++i) rays.push_back(first[order ? order[i] : i]);
}

bool has_plain_kernel(const SceneFeatures& f) {
  return f.only_lambert && !f.textures && !f.normal_maps && !f.vertex_colors && !f.instances && !f.spheres &&
         !f.smooth_normals && !f.absorption;
}

// pt+bdpt without tiles is the path tracer: nothing is known in favour of light paths.
static bool has_light_paths(Integrator integrator, const Film& film, const PixelRect& window) {
  const LightTiles* tiles = film.light_tiles().get();
  if (!tiles) return traces_light_paths(integrator) && integrator != Integrator::pt_bdpt;
  return traces_light_paths(integrator) && tiles->on(window.x0, window.y0);
}

bool trace_window(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                  const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                  TraceStats& stats, const SampleTargets* targets, const LightVertexCache* lights) {
  return trace_window_logged(scene, camera, settings, range, window, cancel, film, stats, nullptr, targets, lights);
}

bool trace_pixels(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                  std::span<const PixelPosition> pixels, std::uint32_t index, const CancelToken& cancel,
                  std::span<Rgb> radiance, TraceStats& stats) {
  HELIO_DCHECK(radiance.size() >= pixels.size());
  Film none(1, 1);
  const PixelList list{pixels, radiance};
  WindowTask task{scene.impl(), camera, settings, {0, index, 1}, {}, cancel, none, nullptr};
  task.pixels = &list;
  return run_pixel_kernel(task, has_plain_kernel(scene.features()) && !settings.general_kernel, stats);
}

bool trace_window_logged(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                         const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                         TraceStats& stats, RayLog* log, const SampleTargets* targets, const LightVertexCache* lights) {
  const PixelRect rect = intersect(window, film.bounds());
  if (rect.empty() || range.count == 0) return !cancel.cancelled();
  WindowTask task{scene.impl(), camera, settings, range, rect, cancel, film, log, targets};
  if (caches_light_vertices(settings.integrator)) {
    task.lights = lights;
    return run_cached_kernel(task, stats);
  }
  if (has_light_paths(settings.integrator, film, rect)) return run_bidirectional_kernel(task, stats);
  // Two kernels of the path tracer: the general one, and the one for scenes of flat Lambert triangles. helio_bench
  // features says what the second earns.
  const bool plain = has_plain_kernel(scene.features()) && !settings.general_kernel;
  if (plain) return run_lambert_kernel(task, stats);
  // Lambert surfaces look alike from everywhere.
  const bool keeps = film.history() && !scene.features().only_lambert;
  return keeps ? run_direction_recording_kernel(task, stats) : run_general_kernel(task, stats);
}

}  // namespace helio
