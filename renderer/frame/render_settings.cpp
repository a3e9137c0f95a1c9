#include "renderer/frame/render_settings.h"

#include <algorithm>
#include <cmath>

namespace helio {

namespace {

constexpr int kMaxPathLength = 65535;
constexpr NumberRange kPaperIterations{3, 1u << 20};

std::string text(const PixelRect& r) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "[%d, %d) x [%d, %d)", r.x0, r.x1, r.y0, r.y1);
  return buffer;
}

void refuse(Problems& problems, const std::string& where, const std::string& value, const std::string& allowed) {
  problems.add(where, value + "; allowed: " + allowed);
}

void check_number(double value, const NumberRange& range, const std::string& where, Problems& problems) {
  if (!range.contains(value)) refuse(problems, where, number_text(value), range.to_string());
}

bool is_paper(const RenderSettings& s) {
  return s.variant == ModeVariant::paper;
}
bool reuses_by_paper(const RenderSettings& s) {
  return reuses(s.mode) && is_paper(s);
}

using Settings = RenderSettings;
using Number = std::optional<double>;
using Use = FieldUse<Settings>;
constexpr Use kAllocating{"mode adaptive or combined", [](auto& s) { return allocates(s.mode); }};
constexpr Use kBounded{kAllocating.words, [](auto& s) { return allocates(s.mode) && !is_paper(s); }};
constexpr Use kPaper{"mode adaptive or combined with variant paper",
                     [](auto& s) { return allocates(s.mode) && is_paper(s); }};
constexpr Use kReusing{"mode reproject or combined with variant paper", reuses_by_paper};
constexpr Use kVaried{"mode adaptive, reproject or combined", [](auto& s) { return s.mode != RenderMode::pt; }};
constexpr Use kConnecting{"integrator lvc or vcm", [](auto& s) {
                            return caches_light_vertices(s.integrator) && s.integrator != Integrator::photon;
                          }};
constexpr Use kMerging{"integrator vcm or photon", [](auto& s) { return merges(s.integrator); }};
constexpr Use kFoveated{"foveation density", [](auto& s) { return s.foveation.kind == Foveation::density; }};
constexpr Use kPublished{"foveation paper", [](auto& s) { return s.foveation.kind == Foveation::paper; }};
constexpr Use kScaled{"filter tent or gaussian", [](auto& s) { return s.filter.kind != PixelFilterKind::box; }};

// Of a path with several rows one at most counts.
constexpr SettingField<Settings> kSettingsFields[] = {
    {"variant", {}, nullptr, kVaried},
    {"adaptive.min_samples", {4, 65536}, [](auto& s) -> Number { return s.adaptive.min_samples; }, kBounded},
    {"adaptive.min_samples", {2, 65536}, [](auto& s) -> Number { return s.adaptive.min_samples; }, kPaper},
    {"adaptive.max_samples", kPaperIterations, [](auto& s) -> Number { return s.adaptive.max_samples; }, kPaper},
    {"adaptive.measure", {}, nullptr, kAllocating},
    {"reprojection.stored_hits", {1, 4}, nullptr, kReusing},
    {"reprojection.max_error", {0, 1e6, false}, [](auto& s) -> Number { return s.reprojection.max_error; }, kReusing},
    {"light_cache.connections", {1, 64}, [](auto& s) -> Number { return s.light_cache.connections; }, kConnecting},
    {"light_cache.radius", {1e-6, 0.1}, [](auto& s) -> Number { return s.light_cache.radius; }, kMerging},
    {"max_segments", {1, kMaxPathLength}, [](auto& s) -> Number { return s.max_segments; }},
    {"roulette_from", {1, kMaxPathLength}, [](auto& s) -> Number { return s.roulette_from; }},
    {"filter_scale", {0, kMaxPixelFilterScale, false}, [](auto& s) -> Number { return s.filter.scale; }, kScaled},
    {"preview_rate", {0, 120}, [](auto& s) -> Number { return s.preview.rate; }},
    {"preview_budget_ms", {5, 1000}, [](auto& s) -> Number { return 1e3 * s.preview.budget_s; }},
    {"preview_upscaling", {}, nullptr},
    {"foveation", {}, nullptr},
    {"viewing_distance", {0.25, 20}, [](auto& s) -> Number { return s.foveation.viewing_distance; }, kFoveated},
    {"foveation_paper.disk", {0.01, 1}, [](auto& s) -> Number { return s.foveation.published.disk; }, kPublished}};

constexpr SettingField<Budget> kBudgetFields[] = {
    {"time_s", kPositiveNumber, [](auto& b) { return b.time_s; }},
    {"samples", kSampleBudget, [](auto& b) -> Number { return b.samples; }},
    {"error", kPositiveNumber, [](auto& b) { return b.error; }},
    {"bytes_per_second", kPositiveNumber, [](auto& b) { return b.bytes_per_second; }}};

template <class T>
void check_fields(std::span<const SettingField<T>> fields, const T& settings, const std::string& where,
                  Problems& problems) {
  for (const SettingField<T>& field : fields) {
    if (!field.value || !field.use.holds(settings)) continue;
    if (const Number value = field.value(settings))
      check_number(*value, field.range, field_path(where, field.path), problems);
  }
}

// Beyond the ranges of the table.
void check_adaptive(const RenderSettings& settings, const std::string& where, Problems& problems) {
  const AdaptiveSettings& adaptive = settings.adaptive;
  if (adaptive.min_samples % 2 != 0)
    refuse(problems, field_path(where, "adaptive.min_samples"), std::to_string(adaptive.min_samples) + " is odd",
           "even numbers, half of the samples for each of two halves");
  if (is_paper(settings) && kPaperIterations.contains(adaptive.max_samples) &&
      adaptive.max_samples <= adaptive.min_samples)
    refuse(problems, field_path(where, "adaptive.max_samples"), std::to_string(adaptive.max_samples),
           "more than min_samples = " + std::to_string(adaptive.min_samples));
}

void check_integrator(const RenderSettings& settings, const std::string& where, Problems& problems) {
  const std::string name = to_string(settings.integrator);
  if (traces_light_paths(settings.integrator) && settings.max_segments > kMostJoinedSegments)
    problems.add(where, name + " with max_segments " + std::to_string(settings.max_segments) +
                            "; allowed there: " + NumberRange{1, kMostJoinedSegments}.to_string());
  if (!traces_light_paths(settings.integrator) || settings.mode == RenderMode::pt) return;
  if (caches_light_vertices(settings.integrator)) {
    problems.add(where, name + " in mode " + to_string(settings.mode) +
                            "; allowed there: path" +
                            (is_paper(settings)           ? ""
                             : reuses(settings.mode)      ? ", bdpt, pt+bdpt"
                                                          : ", light, bdpt, pt+bdpt") +
                            "; " + name + " needs mode pt");
    return;
  }
  if (!is_paper(settings) && !(reuses(settings.mode) && settings.integrator == Integrator::light)) return;
  problems.add(where, name + " in mode " + to_string(settings.mode) + " (variant " + to_string(settings.variant) +
                          "); allowed there: path; light in mode pt, and adaptive with variant bounded; bdpt and "
                          "pt+bdpt in mode pt, and all others with variant bounded");
}

void check_technique(const RenderSettings& settings, const std::string& where, Problems& problems) {
  const int s = settings.technique->light_vertices, t = settings.technique->camera_vertices;
  if (settings.integrator != Integrator::bdpt || settings.mode != RenderMode::pt)
    problems.add(where, std::string("integrator ") + to_string(settings.integrator) + " in mode " +
                            to_string(settings.mode) + "; allowed: integrator bdpt in mode pt");
  const int most = std::max(settings.max_segments, 0);
  const std::size_t before = problems.size();
  check_number(s, {0, double(most)}, field_path(where, "light_vertices"), problems);
  check_number(t, {1, double(most) + 1}, field_path(where, "camera_vertices"), problems);
  if (problems.size() > before) return;
  const std::string both = "light_vertices " + std::to_string(s) + " with camera_vertices " + std::to_string(t);
  if (s == 1 && t == 1) {
    problems.add(where, both + ": lights seen directly come from light_vertices 0 with camera_vertices 2");
  } else if (s == 0 && t == 1) {
    problems.add(where, both + " is no path; allowed: at least 2 in all");
  } else if (s + t > most + 1) {
    problems.add(where, both + " is " + std::to_string(s + t - 1) +
                            " segments; allowed: [1, max_segments = " + std::to_string(most) + "]");
  }
}

void check_device(const RenderSettings& settings, const std::string& where, Problems& problems) {
  if (settings.device.kind == RenderDevice::Kind::cpu) return;
  if (settings.mode == RenderMode::pt && settings.integrator == Integrator::path) return;
  problems.add(where, to_string(settings.device) + " with integrator " + to_string(settings.integrator) + " in mode " +
                          to_string(settings.mode) + "; Vulkan devices have integrator path in mode pt");
}

// Of films whose counts follow a gaze.
void check_foveation(const RenderSettings& settings, const std::string& where, Problems& problems) {
  const auto refuse_with = [&](const std::string& what, const char* allowed) {
    refuse(problems, where, std::string(to_string(settings.foveation.kind)) + " with " + what, allowed);
  };
  if (caches_light_vertices(settings.integrator))
    refuse_with(std::string("integrator ") + to_string(settings.integrator), "with path, light, bdpt, pt+bdpt");
  if (is_paper(settings) && settings.mode != RenderMode::pt) refuse_with("variant paper", "with variant bounded");
  if (settings.device.kind != RenderDevice::Kind::cpu)
    refuse_with("device " + to_string(settings.device), "with device cpu");
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

const char* to_string(Foveation foveation) {
  switch (foveation) {
    case Foveation::none:
      return "none";
    case Foveation::density:
      return "density";
    case Foveation::paper:
      return "paper";
  }
  return "unknown";
}

std::optional<GazeDensity> gaze_density(const RenderSettings& settings, const std::optional<Gaze>& gaze) {
  if (!gaze || settings.foveation.kind != Foveation::density) return std::nullopt;
  return GazeDensity(*gaze, settings.height, settings.foveation.viewing_distance);
}

std::span<const SettingField<RenderSettings>> settings_fields() {
  return kSettingsFields;
}

std::span<const SettingField<Budget>> budget_fields() {
  return kBudgetFields;
}

const SettingField<RenderSettings>* find_field(std::string_view path, const RenderSettings& settings) {
  const SettingField<RenderSettings>* found = nullptr;
  for (const SettingField<RenderSettings>& field : kSettingsFields) {
    if (field.path != path) continue;
    if (field.use.holds(settings)) return &field;
    if (!found) found = &field;
  }
  return found;
}

std::string field_path(const std::string& where, const char* path) {
  return where.empty() ? path : where + "." + path;
}

void validate(const RenderSettings& settings, const RenderLimits& limits, const std::string& where,
              Problems& problems) {
  const std::size_t before = problems.size();
  const NumberRange side{1, double(limits.max_film_side)};
  check_number(settings.width, side, field_path(where, "width"), problems);
  check_number(settings.height, side, field_path(where, "height"), problems);
  if (problems.size() == before) {
    const std::uint64_t pixels = std::uint64_t(settings.width) * std::uint64_t(settings.height);
    if (pixels > limits.max_film_pixels)
      refuse(problems, field_path(where, "width x height"),
             std::to_string(settings.width) + " x " + std::to_string(settings.height) + " = " + std::to_string(pixels) +
                 " pixels",
             "[1, " + std::to_string(limits.max_film_pixels) + "]");
    if (settings.region)
      check_region(*settings.region, settings.width, settings.height, field_path(where, "region"), problems);
  }
  check_integrator(settings, field_path(where, "integrator"), problems);
  if (settings.technique) check_technique(settings, field_path(where, "technique"), problems);
  check_device(settings, field_path(where, "device"), problems);
  if (settings.foveation.kind == Foveation::density)
    check_foveation(settings, field_path(where, "foveation"), problems);
  check_fields(settings_fields(), settings, where, problems);
  if (allocates(settings.mode)) check_adaptive(settings, where, problems);
  const int hits = settings.reprojection.stored_hits;
  if (reuses_by_paper(settings) && hits != 1 && hits != 4)
    refuse(problems, field_path(where, "reprojection.stored_hits"), std::to_string(hits), "1, 4");
}

void validate(const Budget& budget, const std::string& where, Problems& problems) {
  check_fields(budget_fields(), budget, where, problems);
}

void validate(const Gaze& gaze, const std::string& where, Problems& problems) {
  check_number(gaze.x, {-kMostGazePixels, kMostGazePixels}, field_path(where, "x"), problems);
  check_number(gaze.y, {-kMostGazePixels, kMostGazePixels}, field_path(where, "y"), problems);
}

void validate(const View& view, const std::string& where, Problems& problems) {
  validate(view.camera, field_path(where, "camera"), problems);
  check_number(view.time_s, kAnyNumber, field_path(where, "time_s"), problems);
  check_number(view.exposure, kExposureStops, field_path(where, "exposure"), problems);
  if (view.gaze) validate(*view.gaze, field_path(where, "gaze"), problems);
}

}  // namespace helio
