// Settings of a session or a job: plain values with their validation.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "renderer/base/gaze_density.h"
#include "renderer/base/math.h"
#include "renderer/base/number_range.h"
#include "renderer/base/pixel_filter.h"
#include "renderer/base/published_foveation.h"
#include "renderer/base/result.h"
#include "renderer/frame/render_device.h"
#include "renderer/trace/camera/camera.h"
#include "renderer/trace/paths/integrator.h"
#include "renderer/trace/paths/light_cache_settings.h"
#include "renderer/trace/paths/technique.h"
#include "renderer/trace/sampling/roulette.h"

namespace helio {

enum class RenderMode {
  pt,         // every pixel gets the same number of samples
  adaptive,   // pixels get as many as their noise and cost ask for (film/allocation/sample_allocation.h)
  reproject,  // pt, with samples of earlier pictures reprojected into each new one (trace/reuse/reprojection.h)
  combined,   // both
};
inline constexpr RenderMode kEveryRenderMode[] = {RenderMode::pt, RenderMode::adaptive, RenderMode::reproject,
                                                  RenderMode::combined};
// Counts differ from pixel to pixel.
constexpr bool allocates(RenderMode mode) {
  return mode == RenderMode::adaptive || mode == RenderMode::combined;
}
// Pictures draw on those before.
constexpr bool reuses(RenderMode mode) {
  return mode == RenderMode::reproject || mode == RenderMode::combined;
}
const char* to_string(RenderMode mode);

enum class ErrorMeasure { rmse, relmse };  // radiance units | mean(variance / (mean^2 + 1e-2 (image mean)^2))

enum class ModeVariant {
  bounded,  // Heliograph's method: unbiased counts, reuse with a bound on its bias
  paper,    // Schalk 2018 as published: a baseline, biased
};
const char* to_string(ModeVariant variant);

// Schalk 2018: 2 or 4 were the best.
inline constexpr std::uint32_t kPaperMinSamples = 4;

// Modes adaptive and combined.
struct AdaptiveSettings {
  std::uint32_t min_samples = 16;  // per pixel, both halves, before counts differ; even, [4, 65536]; paper: [2, 65536]
  std::uint32_t max_samples = 32;  // variant paper: the iteration at which the threshold reaches 0; (min_samples, 2^20]
  ErrorMeasure measure = ErrorMeasure::relmse;  // bounded: the error that the counts make small

  bool operator==(const AdaptiveSettings&) const = default;
};

// Modes reproject and combined.
struct ReprojectionSettings {
  // Variant paper.
  int stored_hits = 4;           // first hits kept per pixel: 1 or 4, which the paper found the best
  double max_error = 1.0 / 256;  // of its eq. 15, radiance; (0, 1e6]

  bool operator==(const ReprojectionSettings&) const = default;
};

// Previews while the camera moves (preview/preview.h). They change nothing about films.
struct PreviewSettings {
  double rate = 0;          // pictures a second at most, [0, 120]; 0: none
  double budget_s = 0.045;  // wall time of a preview, [0.005, 1]
  // Surfaces are traced in every second pixel along either axis, other ones in each preview, and in all along edges;
  // what is between comes from these and from the preview before (preview/sparse_surfaces.h).
  bool upscaling = false;

  bool operator==(const PreviewSettings&) const = default;
};

// What a gaze (View::gaze) changes; without one, nothing.
enum class Foveation {
  none,
  // Counts of the film, unbiased, and what previews look at fall with the distance from it (base/gaze_density.h).
  density,
  // Previews are as published (preview/paper/paper_preview.h); films are as with none.
  paper,
};
const char* to_string(Foveation foveation);
struct FoveationSettings {
  Foveation kind = Foveation::none;
  double viewing_distance = 2;  // of density: of the eye from the picture, in heights of it, [0.25, 20]
  PublishedFoveation published;  // of paper

  bool operator==(const FoveationSettings&) const = default;
};

struct RenderSettings {
  int width = 1280, height = 720;  // [1, limits.max_film_side], width * height <= limits.max_film_pixels
  RenderMode mode = RenderMode::pt;
  ModeVariant variant = ModeVariant::bounded;
  // path: every mode and variant. bdpt, pt+bdpt: mode pt, and the other modes with variant bounded. light: mode pt, and
  // adaptive with variant bounded; not the modes that reuse pictures, because what an edit changes is measured with the
  // path tracer, which sees light that `light` does not. lvc, vcm, photon: mode pt.
  Integrator integrator = Integrator::path;
  // Integrator bdpt in mode pt: renders this technique alone, which exists() and has at most max_segments; absent: all,
  // combined by MIS.
  std::optional<Technique> technique;
  AdaptiveSettings adaptive;
  ReprojectionSettings reprojection;
  LightCacheSettings light_cache;  // integrators that cache light vertices
  std::uint64_t seed = 0;
  int max_segments = 10;  // of a path; [1, 65535]; integrators with light paths: [1, 256]
  int roulette_from = 3;  // segments from which Russian roulette may end a path; [1, 65535]
  RouletteRule roulette = RouletteRule::root;
  PixelFilter filter;
  std::optional<PixelRect> region;  // of interest; inside the film; none: the whole film
  RenderDevice device;              // other than cpu: integrator path in mode pt
  PreviewSettings preview;
  FoveationSettings foveation;  // density: integrators with every pixel's own counts, on the CPU, variant bounded

  PixelRect rendered_region() const { return region.value_or(PixelRect{0, 0, width, height}); }
  bool operator==(const RenderSettings&) const = default;
};

// Pixels of a film may get different numbers of samples.
inline bool counts_differ(const RenderSettings& settings) {
  return allocates(settings.mode) || settings.foveation.kind == Foveation::density;
}

// Of its previews.
inline bool as_published(const RenderSettings& settings) {
  return settings.foveation.kind == Foveation::paper;
}

// Whether films of both are of the same pictures: all is equal but previews.
inline bool same_pictures(RenderSettings a, const RenderSettings& b) {
  a.preview = b.preview;
  if (a.foveation.kind != Foveation::density && b.foveation.kind != Foveation::density) a.foveation = b.foveation;
  return a == b;
}

struct RenderLimits {
  int max_film_side = 65536;
  std::uint64_t max_film_pixels = 64ull << 20;
};

// The first that is reached ends the frame. All absent: it renders until superseded, at most kMaxSamplesPerPixel
// (frame_scheduler.h).
struct Budget {
  std::optional<double> time_s;          // wall time since the frame began, > 0
  std::optional<std::uint32_t> samples;  // per pixel, both halves together; [1, 2^30]
  std::optional<double> error;           // target standard error, radiance units, > 0
  std::optional<double> bytes_per_second;  // of tiles sent; paces publishing, never ends a frame; > 0

  bool operator==(const Budget&) const = default;
};

struct View {
  std::uint64_t id = 0;  // monotonic per session
  CameraPose camera;
  double time_s = 0;    // scene time; only the time the scene was loaded at is served for now
  double exposure = 0;  // stops, display only: does not change what is rendered
  std::optional<Gaze> gaze = {};  // absent: nobody looks anywhere in particular
};

// What the gaze asks of a film of these settings, and of its previews; absent: nothing.
std::optional<GazeDensity> gaze_density(const RenderSettings& settings, const std::optional<Gaze>& gaze);

// Segments that an integrator with light paths may have at most: every vertex of a light path is kept, and joined to
// every vertex of a camera path.
inline constexpr int kMostJoinedSegments = 256;

// Settings that do without a field ignore it.
template <class T>
struct FieldUse {
  const char* words = nullptr;
  bool (*by)(const T&) = nullptr;  // null: by all

  bool holds(const T& settings) const { return !by || by(settings); }
};
// A field of the protocol's RenderSettings or Budget: one table for the validator and for the command line.
template <class T>
struct SettingField {
  const char* path;   // as the protocol spells it: "adaptive.min_samples"
  NumberRange range;  // of numbers
  std::optional<double> (*value)(const T&) = nullptr;  // null: is not a number, or has rules beyond a range
  FieldUse<T> use = {};
};
std::span<const SettingField<RenderSettings>> settings_fields();
std::span<const SettingField<Budget>> budget_fields();
// The row that counts with these settings, else the first of the path; null: there is none.
const SettingField<RenderSettings>* find_field(std::string_view path, const RenderSettings& settings);

// "where.path", or the path alone where `where` is empty.
std::string field_path(const std::string& where, const char* path);
// Adds every problem, each with the path of its field behind `where`.
void validate(const RenderSettings& settings, const RenderLimits& limits, const std::string& where, Problems& problems);
void validate(const Budget& budget, const std::string& where, Problems& problems);
void validate(const Gaze& gaze, const std::string& where, Problems& problems);
void validate(const View& view, const std::string& where, Problems& problems);

}  // namespace helio
