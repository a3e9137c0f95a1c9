#include "renderer/film/estimate/channels.h"

#include <cfloat>
#include <cmath>

#include "renderer/film/history/film_history.h"

namespace helio {
namespace {

template <class Value>
void fill(const PixelRect& window, std::vector<float>& out, const Value& value) {
  out.resize(std::size_t(window.area()));
  std::size_t i = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) out[i++] = value(x, y);
  }
}

float to_float(double x) {
  return float(std::min(x, double(FLT_MAX)));
}

// Features without samples: black, no normal, no coverage.
void resolve_alpha(const Film& film, double, ResolvedTile& tile) {
  fill(tile.window, tile.alpha, [&](int x, int y) {
    const PixelFeatures& f = film.features(x, y);
    return f.count > 0 ? float(double(f.hits) / f.count) : 0.0f;
  });
}

void resolve_depth(const Film& film, double, ResolvedTile& tile) {
  fill(tile.window, tile.depth, [&](int x, int y) { return film.features(x, y).depth; });
}

void resolve_normal(const Film& film, double, ResolvedTile& tile) {
  for (int c = 0; c < 3; ++c)
    fill(tile.window, tile.normal[c], [&](int x, int y) { return film.features(x, y).normal[c]; });
}

void resolve_albedo(const Film& film, double, ResolvedTile& tile) {
  for (int c = 0; c < 3; ++c)
    fill(tile.window, tile.albedo[c], [&](int x, int y) { return film.features(x, y).albedo[c]; });
}

void resolve_history(const Film& film, double, ResolvedTile& tile) {
  const PixelRect& window = tile.window;
  const FilmHistory* history = film.history();
  if (!history) {
    for (std::vector<float>* channel : {&tile.history_weight, &tile.bias_bound, &tile.history_age})
      channel->assign(std::size_t(window.area()), 0.0f);
    return;
  }
  fill(window, tile.history_weight,
       [&](int x, int y) { return float(history->weight(x, y, film.half(0, x, y).count, film.half(1, x, y).count)); });
  fill(window, tile.bias_bound, [&](int x, int y) {
    return to_float(std::sqrt(history->bias2(x, y, film.half(0, x, y).count, film.half(1, x, y).count)));
  });
  fill(window, tile.history_age, [&](int x, int y) {
    const double weight = history->weight(x, y, film.half(0, x, y).count, film.half(1, x, y).count);
    return float(weight * history->carried(x, y).age);
  });
}

void resolve_density(const Film& film, double mean_samples, ResolvedTile& tile) {
  const double scale = mean_samples > 0 ? 1 / mean_samples : 0;
  fill(tile.window, tile.density, [&](int x, int y) {
    return scale > 0 ? to_float(scale * (double(film.attempted(0, x, y)) + film.attempted(1, x, y))) : 1.0f;
  });
}

using Plane = const std::vector<float>;

constexpr ChannelPlane kRadiance[] = {
    {"R", [](const ResolvedTile& t) -> Plane& { return t.radiance[0]; }},
    {"G", [](const ResolvedTile& t) -> Plane& { return t.radiance[1]; }},
    {"B", [](const ResolvedTile& t) -> Plane& { return t.radiance[2]; }},
};
constexpr ChannelPlane kVariance[] = {
    {"variance.R", [](const ResolvedTile& t) -> Plane& { return t.variance[0]; }, Storage::positive_half},
    {"variance.G", [](const ResolvedTile& t) -> Plane& { return t.variance[1]; }, Storage::positive_half},
    {"variance.B", [](const ResolvedTile& t) -> Plane& { return t.variance[2]; }, Storage::positive_half},
};
constexpr ChannelPlane kSamples[] = {
    {"samples", [](const ResolvedTile& t) -> Plane& { return t.samples; }, Storage::count},
};
constexpr ChannelPlane kAlpha[] = {
    {"A", [](const ResolvedTile& t) -> Plane& { return t.alpha; }},
};
constexpr ChannelPlane kDepth[] = {
    {"Z", [](const ResolvedTile& t) -> Plane& { return t.depth; }, Storage::float32},
};
constexpr ChannelPlane kNormal[] = {
    {"N.x", [](const ResolvedTile& t) -> Plane& { return t.normal[0]; }},
    {"N.y", [](const ResolvedTile& t) -> Plane& { return t.normal[1]; }},
    {"N.z", [](const ResolvedTile& t) -> Plane& { return t.normal[2]; }},
};
constexpr ChannelPlane kAlbedo[] = {
    {"albedo.r", [](const ResolvedTile& t) -> Plane& { return t.albedo[0]; }},
    {"albedo.g", [](const ResolvedTile& t) -> Plane& { return t.albedo[1]; }},
    {"albedo.b", [](const ResolvedTile& t) -> Plane& { return t.albedo[2]; }},
};
constexpr ChannelPlane kHistory[] = {
    {"history.weight", [](const ResolvedTile& t) -> Plane& { return t.history_weight; }, Storage::positive_half},
    {"bias.bound", [](const ResolvedTile& t) -> Plane& { return t.bias_bound; }, Storage::positive_half},
    {"history.age", [](const ResolvedTile& t) -> Plane& { return t.history_age; }},
};
constexpr ChannelPlane kDensity[] = {
    {"samples.density", [](const ResolvedTile& t) -> Plane& { return t.density; }},
};

constexpr ChannelPlane kDisplay[] = {
    {"display.R", [](const ResolvedTile& t) -> Plane& { return t.display[0]; }},
    {"display.G", [](const ResolvedTile& t) -> Plane& { return t.display[1]; }},
    {"display.B", [](const ResolvedTile& t) -> Plane& { return t.display[2]; }},
    {"display.error", [](const ResolvedTile& t) -> Plane& { return t.display_error; }, Storage::positive_half},
};

constexpr Channel kTable[] = {
    {0, "", true, kRadiance, nullptr},
    {kResolveVariance, "variance", true, kVariance, nullptr},
    {kResolveSamples, "samples", true, kSamples, nullptr},
    {kResolveAlpha, "alpha", false, kAlpha, resolve_alpha},
    {kResolveDepth, "depth", false, kDepth, resolve_depth},
    {kResolveNormal, "normal", false, kNormal, resolve_normal},
    {kResolveAlbedo, "albedo", false, kAlbedo, resolve_albedo},
    {kResolveHistory, "history", false, kHistory, resolve_history},
    {kResolveDensity, "density", false, kDensity, resolve_density},
    {kResolveDisplay, "display", false, kDisplay, nullptr},
};

}  // namespace

std::span<const Channel> channel_table() {
  return kTable;
}

std::size_t ResolvedTile::bytes() const {
  std::size_t floats = 0;
  for (const Channel& channel : kTable)
    for (const ChannelPlane& plane : channel.planes) floats += plane.of(*this).size();
  return floats * sizeof(float);
}

}  // namespace helio
