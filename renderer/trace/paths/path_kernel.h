// The path tracer's kernels and what they are run with. Internal to trace/, to the
// tracers of other variants (frame/variant_parts.h) and to the ray benchmark.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "renderer/trace/paths/path_integrator.h"
#include "renderer/trace/scene/scene_data.h"

namespace helio {

// Every ray of a run in the order it was traced, for the ray benchmark. Not thread safe: one log per thread.
struct RayLog {
  struct Batch {
    bool occlusion = false;
    std::uint32_t count = 0;
  };
  std::vector<Batch> batches;
  std::vector<Ray> rays;

  // order: null for 0, 1, 2, ...
  void add(const Ray* first, const std::uint32_t* order, std::size_t count, bool occlusion);
};

struct SampleTrace;
class SplatBuffer;

// Pixels of trace_pixels() and what their samples come to.
struct PixelList {
  std::span<const PixelPosition> pixels;
  std::span<Rgb> radiance;
};

struct WindowTask {
  const SceneData& scene;
  const Camera& camera;
  const PathSettings& settings;
  SampleRange range;
  PixelRect window;
  const CancelToken& cancel;
  Film& film;
  RayLog* log;
  const SampleTargets* targets = nullptr;  // who takes part in which level; null: everyone
  // Of those that recorder alone: what becomes of the sample, and the film's size.
  // The range is that one sample, the window its pixel; the film is not touched.
  SampleTrace* trace = nullptr;
  // run_bidirectional_kernel() alone. Of the film's size, of each pixel: rare_squares() of a sample's finds, x the path
  // tracer's and y its own, in unit_of_squares(). Null: nobody asks.
  SplatBuffer* squares = nullptr;
  float rare = 0;
  const Camera* splat_camera = nullptr;  // whose film light paths land on; null: the camera's own
  // run_cached_kernel() and the one that watches it: of the range's one sample and half, ready.
  const LightVertexCache* lights = nullptr;
  // run_pixel_kernel() alone: in place of window and film.
  const PixelList* pixels = nullptr;
};

// Whether the kernel for flat Lambert triangles suits the scene.
bool has_plain_kernel(const SceneFeatures& features);
bool run_lambert_kernel(const WindowTask& task, TraceStats& stats);
bool run_general_kernel(const WindowTask& task, TraceStats& stats);
bool run_sample_trace_kernel(const WindowTask& task);
bool run_bidirectional_sample_trace_kernel(const WindowTask& task);
bool run_cached_sample_trace_kernel(const WindowTask& task);
// Integrators light, bdpt and pt_bdpt; the film has splats.
bool run_bidirectional_kernel(const WindowTask& task, TraceStats& stats);
// Integrators that draw on a LightVertexCache.
bool run_cached_kernel(const WindowTask& task, TraceStats& stats);
// The second, for a film that keeps directions.
bool run_direction_recording_kernel(const WindowTask& task, TraceStats& stats);
// Either of the first two, over a list of pixels.
bool run_pixel_kernel(const WindowTask& task, bool plain, TraceStats& stats);

// trace_window, with the rays written down when log is not null.
bool trace_window_logged(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                         const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                         TraceStats& stats, RayLog* log, const SampleTargets* targets = nullptr,
                         const LightVertexCache* lights = nullptr);

}  // namespace helio
