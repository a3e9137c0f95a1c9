// Path tracing with next-event estimation and multiple importance sampling.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "renderer/base/cancel.h"
#include "renderer/base/math.h"
#include "renderer/film/core/film.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/integrator.h"
#include "renderer/trace/paths/light_cache_settings.h"
#include "renderer/trace/paths/technique.h"
#include "renderer/trace/sampling/roulette.h"
#include "renderer/trace/scene/render_scene.h"

namespace helio {

class LightVertexCache;

struct PathSettings {
  std::uint64_t seed = 0;
  int max_segments = 10;  // path segments, camera segment included (2: direct light); [1, 65535]
  int roulette_from = 3;  // first vertex (camera = 1st is the first hit) at which Russian roulette may end a path; >= 1
  RouletteRule roulette = RouletteRule::root;
  Integrator integrator = Integrator::path;  // all but path and photon need a film with splats
  std::optional<Technique> technique;  // integrator bdpt: what this one brings alone; it exists(). None: all together
  LightCacheSettings light_cache;
  PixelRect region;  // whose pixels get samples, and so light paths; empty: the whole film
  bool general_kernel = false;  // ignore SceneFeatures: the reference that specialised kernels must match bit for bit

  bool operator==(const PathSettings&) const = default;
};

// Side of the blocks, aligned to the film and clipped to it, whose pixels are traced together: windows aligned to it
// waste nothing.
inline constexpr int kPathGroupSize = kFilmBlock;

// Samples [first, first + count) of one half; with SampleTargets, of these the ones that the pixel still needs.
struct SampleRange {
  int half = 0;
  std::uint32_t first = 0, count = 0;
};

// The sample whose radiance, or whose light path's at the camera, was not finite or more than splats can be. With the
// scene, the camera and the settings, enough to trace it again (trace_sample).
struct InvalidSample {
  int x = 0, y = 0, half = 0;
  std::uint32_t index = 0;
  // Number of light paths traced for one sample of every pixel; MIS weights depend on it. 0: the sample was traced by
  // `path`.
  std::uint64_t light_paths = 0;
  // With a LightVertexCache: number of the light path that was invalid, from 1; x and y are then 0. 0: the pixel's own
  // sample was invalid.
  std::uint64_t light_path = 0;

  bool operator==(const InvalidSample&) const = default;
};

struct TraceStats {
  std::uint64_t paths = 0;
  std::uint64_t light_paths = 0;
  std::uint64_t rays = 0;         // intersection and occlusion queries, camera rays included
  std::uint64_t shadow_rays = 0;  // of these
  std::uint64_t invalid_samples = 0;
  std::uint64_t invalid_splats = 0;  // of light paths: not among those
  std::uint64_t bright_splats = 0;   // of these: finite, but more than a film holds (SplatBuffer)
  // Times that a path entered a medium within MediumStack::kDepth others, whose absorption it then lacks.
  std::uint64_t media_overflows = 0;
  std::uint64_t dropped = 0;  // carried samples that mixed pixels lost (partial_coverage.h)
  // Meaningful when invalid() > 0: the one of the lowest index, of these of the first half, then of the topmost and
  // leftmost pixel, so that it does not depend on how the work was cut.
  InvalidSample first_invalid;

  std::uint64_t invalid() const { return invalid_samples + invalid_splats; }
  void note_invalid(const InvalidSample& sample);
  // Counts an invalid or too bright splat; `sample` is the one whose light path made it.
  void note_invalid_splat(bool finite, const InvalidSample& sample);
  void add(const TraceStats& other);
};

// Traces the samples of every pixel of `window` and adds them to `film` in index order. For a given scene, camera and
// settings the bits added depend on pixel, sample index and half alone; with `targets` also on which pixels of the
// block take the same sample. Returns false, leaving the film as it was, when `cancel` was raised on the way. Thread
// safe for disjoint windows. Paths are traced in whole blocks of the film (see kPathGroupSize): what lies in a block
// but not in the window is traced too, counted in `stats`, and dropped.
//
// Precondition, where the film has light tiles: all tiles of the window use the same integrator.
//
// With `targets`, which must be of the film's size, a pixel takes part in a level as SampleTargets::wants() says; of a
// block, the pixels of the window that take part in the same level are traced together.
//
// `lights`, required when caches_light_vertices(): the finished cache of the single sample and half of `range`.
bool trace_window(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                  const SampleRange& range, const PixelRect& window, const CancelToken& cancel, Film& film,
                  TraceStats& stats, const SampleTargets* targets = nullptr, const LightVertexCache* lights = nullptr);

struct PixelPosition {
  std::int32_t x = 0, y = 0;
};

// Traces sample `index` of half A of each of the pixels by integrator path, apart from any film; radiance[i] is that of
// pixels[i], NaN where it is not finite. Pixels of one call share packets, so the last bit depends on the list. Returns
// false when `cancel` was raised on the way; the radiance then is of no meaning. Thread safe.
bool trace_pixels(const RenderScene& scene, const Camera& camera, const PathSettings& settings,
                  std::span<const PixelPosition> pixels, std::uint32_t index, const CancelToken& cancel,
                  std::span<Rgb> radiance, TraceStats& stats);

}  // namespace helio
