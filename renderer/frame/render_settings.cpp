#include "renderer/frame/render_settings.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace helio {

namespace {

constexpr int kMostConnections = 64;
constexpr double kSmallestMergingRadius = 1e-6, kLargestMergingRadius = 0.1, kLeastShrinking = 0.1;
constexpr int kMaxPathLength = 65535;
constexpr std::uint32_t kMaxSamples = 1u << 30;
constexpr double kMaxExposureStops = 64;
constexpr std::uint32_t kMostPilotSamples = 65536;
constexpr std::uint32_t kMostPaperSamples = 1u << 20;
constexpr double kLargestMaxError = 1e6;

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", value);
  return buffer;
}

std::string text(const PixelRect& r) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "[%d, %d) x [%d, %d)", r.x0, r.x1, r.y0, r.y1);
  return buffer;
}

std::string field(const std::string& where, const char* name) {
  return where.empty() ? name : where + "." + name;
}

template <class T>
void check_range(T value, T low, T high, const std::string& where, Problems& problems) {
  if (value < low || value > high)
    problems.add(where,
                 std::to_string(value) + " is outside [" + std::to_string(low) + ", " + std::to_string(high) + "]");
}

const std::string kModeNames = "pt, adaptive, reproject, combined";

void check_positive(const std::optional<double>& value, const std::string& where, Problems& problems) {
  if (value && !(std::isfinite(*value) && *value > 0))
    problems.add(where, text(*value) + " is not a finite number above 0");
}

void check_measure(ErrorMeasure measure, const std::string& where, Problems& problems) {
  if (measure != ErrorMeasure::rmse && measure != ErrorMeasure::relmse)
    problems.add(where, std::to_string(int(measure)) + " is not a measure; allowed: rmse, relmse");
}

void check_adaptive(const RenderSettings& settings, const std::string& where, Problems& problems) {
  const AdaptiveSettings& adaptive = settings.adaptive;
  const bool paper = settings.variant == ModeVariant::paper;
  const std::uint32_t least = paper ? 2 : 4;
  check_range(adaptive.min_samples, least, kMostPilotSamples, field(where, "min_samples"), problems);
  if (adaptive.min_samples % 2 != 0)
    problems.add(field(where, "min_samples"), std::to_string(adaptive.min_samples) +
                                                  " is odd; each of the two halves gets the same number of samples");
  if (paper)
    check_range(adaptive.max_samples, std::min(adaptive.min_samples, kMostPilotSamples) + 1, kMostPaperSamples,
                field(where, "max_samples"), problems);
  check_measure(adaptive.measure, field(where, "measure"), problems);
}

void check_reprojection(const RenderSettings& settings, const std::string& where, Problems& problems) {
  const ReprojectionSettings& reprojection = settings.reprojection;
  if (settings.variant == ModeVariant::bounded) return;
  if (reprojection.stored_hits != 1 && reprojection.stored_hits != 4)
    problems.add(field(where, "stored_hits"),
                 std::to_string(reprojection.stored_hits) + " hits are not stored; allowed: 1, 4");
  if (!(reprojection.max_error > 0 && reprojection.max_error <= kLargestMaxError))
    problems.add(field(where, "max_error"),
                 text(reprojection.max_error) + " is outside (0, " + text(kLargestMaxError) + "]");
}

void check_integrator(const RenderSettings& settings, const std::string& where, Problems& problems) {
  if (std::find(std::begin(kEveryIntegrator), std::end(kEveryIntegrator), settings.integrator) ==
      std::end(kEveryIntegrator)) {
    problems.add(where,
                 std::to_string(int(settings.integrator)) + " is not an integrator; allowed: " + integrator_names());
    return;
  }
  // Every vertex of a light path is kept, and joined to every vertex of a camera path.
  constexpr int kMostJoinedSegments = 256;
  if (traces_light_paths(settings.integrator) && settings.max_segments > kMostJoinedSegments)
    problems.add(where, std::string(to_string(settings.integrator)) + " with max_segments " +
                            std::to_string(settings.max_segments) + "; allowed there: [1, 256]");
  if (caches_light_vertices(settings.integrator)) {
    if (settings.mode != RenderMode::pt)
      problems.add(where, std::string(to_string(settings.integrator)) + " in mode " + to_string(settings.mode) +
                              "; allowed there: path, light, bdpt, pt+bdpt; this one in mode pt");
    return;
  }
  const bool reused = !reuses(settings.mode) || settings.integrator != Integrator::light;
  const bool bounded = settings.variant == ModeVariant::bounded && reused;
  if (traces_light_paths(settings.integrator) && settings.mode != RenderMode::pt && !bounded)
    problems.add(where,
                 std::string(to_string(settings.integrator)) + " in mode " + to_string(settings.mode) + " (variant " +
                     to_string(settings.variant) +
                     "); allowed there: path; light in mode pt, and adaptive with variant bounded; bdpt and pt+bdpt "
                     "in mode pt, and all others with variant bounded");
}

void check_light_cache(const LightCacheSettings& cache, const std::string& where, Problems& problems) {
  check_range(cache.connections, 1, kMostConnections, field(where, "connections"), problems);
  if (!(cache.radius >= kSmallestMergingRadius && cache.radius <= kLargestMergingRadius))
    problems.add(field(where, "radius"), text(cache.radius) + " is outside [" + text(kSmallestMergingRadius) + ", " +
                                             text(kLargestMergingRadius) + "] of the scene's radius");
  if (!(cache.shrinking >= kLeastShrinking && cache.shrinking <= 1))
    problems.add(field(where, "shrinking"), text(cache.shrinking) + " is outside [" + text(kLeastShrinking) + ", 1]");
}

void check_technique(const RenderSettings& settings, const std::string& where, Problems& problems) {
  const int s = settings.technique->light_vertices, t = settings.technique->camera_vertices;
  if (settings.integrator != Integrator::bdpt || settings.mode != RenderMode::pt)
    problems.add(where, std::string("of ") + to_string(settings.integrator) + " in mode " + to_string(settings.mode) +
                            "; allowed: of integrator bdpt in mode pt");
  const int most = settings.max_segments;  // of any sign: its own problem
  const std::size_t before = problems.size();
  check_range(s, 0, std::max(most, 0), field(where, "light_vertices"), problems);
  check_range(t, 1, std::max(most, 0) + 1, field(where, "camera_vertices"), problems);
  if (problems.size() > before) return;
  if (s == 1 && t == 1) {
    problems.add(where,
                 "light_vertices 1 with camera_vertices 1: lights seen directly come from light_vertices 0 "
                 "with camera_vertices 2");
  } else if (s == 0 && t == 1) {
    problems.add(where, "light_vertices 0 with camera_vertices 1 is no path; allowed: at least 2 in all");
  } else if (s + t > most + 1) {
    problems.add(where, "light_vertices " + std::to_string(s) + " with camera_vertices " + std::to_string(t) + " is " +
                            std::to_string(s + t - 1) +
                            " segments; allowed: [1, max_segments = " + std::to_string(most) + "]");
  }
}

void check_filter(const PixelFilter& filter, const std::string& where, Problems& problems) {
  switch (filter.kind) {
    case PixelFilterKind::box:
      return;
    case PixelFilterKind::tent:
    case PixelFilterKind::gaussian:
      if (!(filter.scale > 0 && filter.scale <= kMaxPixelFilterScale))
        problems.add(field(where, "filter_scale"),
                     text(filter.scale) + " is outside (0, " + text(kMaxPixelFilterScale) + "] pixels");
      return;
  }
  problems.add(field(where, "filter"),
               std::to_string(int(filter.kind)) + " is not a filter; allowed: box, tent, gaussian");
}

void check_region(const PixelRect& region, int width, int height, const std::string& where, Problems& problems) {
  if (region.empty()) {
    problems.add(where, text(region) + " is empty; x0 < x1 and y0 < y1 are needed");
  } else if (region != intersect(region, PixelRect{0, 0, width, height})) {
    problems.add(where, text(region) + " is not inside the film " + text(PixelRect{0, 0, width, height}));
  }
}

}  // namespace

const char* to_string(RenderMode mode) {
  switch (mode) {
    case RenderMode::pt:
      return "pt";
    case RenderMode::adaptive:
      return "adaptive";
    case RenderMode::reproject:
      return "reproject";
    case RenderMode::combined:
      return "combined";
  }
  return "unknown";
}

const char* to_string(ModeVariant variant) {
  switch (variant) {
    case ModeVariant::bounded:
      return "bounded";
    case ModeVariant::paper:
      return "paper";
  }
  return "unknown";
}

void validate(const RenderSettings& settings, const RenderLimits& limits, const std::string& where,
              Problems& problems) {
  const std::size_t before = problems.size();
  check_range(settings.width, 1, limits.max_film_side, field(where, "width"), problems);
  check_range(settings.height, 1, limits.max_film_side, field(where, "height"), problems);
  if (problems.size() == before) {
    const std::uint64_t pixels = std::uint64_t(settings.width) * std::uint64_t(settings.height);
    if (pixels > limits.max_film_pixels)
      problems.add(field(where, "width") + " x height", std::to_string(settings.width) + " x " +
                                                            std::to_string(settings.height) + " = " +
                                                            std::to_string(pixels) + " pixels is outside [1, " +
                                                            std::to_string(limits.max_film_pixels) + "]");
    if (settings.region)
      check_region(*settings.region, settings.width, settings.height, field(where, "region"), problems);
  }
  if (std::find(std::begin(kEveryRenderMode), std::end(kEveryRenderMode), settings.mode) == std::end(kEveryRenderMode))
    problems.add(field(where, "mode"), std::to_string(int(settings.mode)) + " is not a mode; allowed: " + kModeNames);
  if (settings.variant != ModeVariant::bounded && settings.variant != ModeVariant::paper)
    problems.add(field(where, "variant"),
                 std::to_string(int(settings.variant)) + " is not a variant; allowed: bounded, paper");
  check_integrator(settings, field(where, "integrator"), problems);
  if (caches_light_vertices(settings.integrator))
    check_light_cache(settings.light_cache, field(where, "light_cache"), problems);
  if (settings.technique) check_technique(settings, field(where, "technique"), problems);
  if (reuses(settings.mode)) check_reprojection(settings, field(where, "reprojection"), problems);
  if (allocates(settings.mode)) check_adaptive(settings, field(where, "adaptive"), problems);
  check_range(settings.max_segments, 1, kMaxPathLength, field(where, "max_segments"), problems);
  check_range(settings.roulette_from, 1, kMaxPathLength, field(where, "roulette_from"), problems);
  check_filter(settings.filter, where, problems);
}

void validate(const Budget& budget, const std::string& where, Problems& problems) {
  check_positive(budget.time_s, field(where, "time_s"), problems);
  if (budget.samples) check_range<std::uint32_t>(*budget.samples, 1, kMaxSamples, field(where, "samples"), problems);
  check_positive(budget.error, field(where, "error"), problems);
  check_positive(budget.bytes_per_second, field(where, "bytes_per_second"), problems);
  check_measure(budget.error_measure, field(where, "error_measure"), problems);
}

void validate(const View& view, const std::string& where, Problems& problems) {
  validate(view.camera, field(where, "camera"), problems);
  if (!std::isfinite(view.time_s)) problems.add(field(where, "time_s"), text(view.time_s) + " is not a finite number");
  if (!(std::abs(view.exposure) <= kMaxExposureStops))
    problems.add(field(where, "exposure"), text(view.exposure) + " is outside [-64, 64]");
}

}  // namespace helio
