#include "renderer/frame/render_settings.h"

#include <cmath>
#include <cstdio>

namespace helio {

namespace {

constexpr int kMaxPathLength = 65535;
constexpr std::uint32_t kMaxSamples = 1u << 30;
constexpr double kMaxExposureStops = 64;

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

void check_positive(const std::optional<double>& value, const std::string& where, Problems& problems) {
  if (value && !(std::isfinite(*value) && *value > 0))
    problems.add(where, text(*value) + " is not a finite number above 0");
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
  }
  return "unknown";
}

Result<RenderMode> parse_render_mode(const std::string& name) {
  if (name == "pt") return RenderMode::pt;
  return Error{ErrorCode::invalid_argument, "\"" + name + "\" is not a mode; allowed: pt", "mode"};
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
  if (settings.mode != RenderMode::pt)
    problems.add(field(where, "mode"), std::to_string(int(settings.mode)) + " is not a mode; allowed: pt");
  check_range(settings.max_segments, 1, kMaxPathLength, field(where, "max_segments"), problems);
  check_range(settings.roulette_from, 1, kMaxPathLength, field(where, "roulette_from"), problems);
}

void validate(const Budget& budget, const std::string& where, Problems& problems) {
  check_positive(budget.time_s, field(where, "time_s"), problems);
  if (budget.samples) check_range<std::uint32_t>(*budget.samples, 1, kMaxSamples, field(where, "samples"), problems);
  check_positive(budget.error, field(where, "error"), problems);
  check_positive(budget.bytes_per_second, field(where, "bytes_per_second"), problems);
  if (budget.error_measure != ErrorMeasure::rmse && budget.error_measure != ErrorMeasure::relmse)
    problems.add(field(where, "error_measure"),
                 std::to_string(int(budget.error_measure)) + " is not a measure; allowed: rmse, relmse");
}

void validate(const View& view, const std::string& where, Problems& problems) {
  validate(view.camera, field(where, "camera"), problems);
  if (!std::isfinite(view.time_s)) problems.add(field(where, "time_s"), text(view.time_s) + " is not a finite number");
  if (!(std::abs(view.exposure) <= kMaxExposureStops))
    problems.add(field(where, "exposure"), text(view.exposure) + " is outside [-64, 64]");
}

}  // namespace helio
