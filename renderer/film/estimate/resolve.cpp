#include "renderer/film/estimate/resolve.h"

#include <cfloat>
#include <cmath>

#include "renderer/base/check.h"
#include "renderer/film/estimate/variance_pool.h"
#include "renderer/film/history/film_history.h"
#include "renderer/film/history/splat_row.h"
#include "renderer/film/splats/splat_buffer.h"

namespace helio {
namespace {

float to_float(double x) {
  return float(std::min(std::max(x, -double(FLT_MAX)), double(FLT_MAX)));
}

// What reuse may have added to the error counts as variance.
void add_bias(const Film& film, const PixelRect& window, std::vector<float> (&variance)[3]) {
  std::size_t i = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x, ++i) {
      const double bias2 = film.history()->bias2(x, y, film.half(0, x, y).count, film.half(1, x, y).count);
      for (std::vector<float>& channel : variance) channel[i] += to_float(bias2);
    }
  }
}

}  // namespace

Rgb resolve_mean(const Film& film, int x, int y) {
  const HalfPixel& a = film.half(0, x, y);
  const HalfPixel& b = film.half(1, x, y);
  const double weight = a.count > 0 && b.count > 0 ? 0.5 : 1.0;
  const double weight_a = a.count > 0 ? weight / a.count : 0.0;
  const double weight_b = b.count > 0 ? weight / b.count : 0.0;
  thread_local SplatRow row;
  double splats[3] = {0, 0, 0};
  for (int h = 0; h < kHalves && film.splats(); ++h) {
    if (film.half(h, x, y).count == 0) continue;
    row.look(film, h, y, x, x + 1, false);
    for (int c = 0; c < 3; ++c) splats[c] += row.mean(x, c);
  }
  Rgb mean;
  for (int c = 0; c < 3; ++c) mean[c] = to_float(a.sum[c] * weight_a + b.sum[c] * weight_b + weight * splats[c]);
  return mean;
}

ResolvedTile resolve_tile(const Film& film, const PixelRect& window, const PixelRect& roi, unsigned channels,
                          double mean_samples) {
  HELIO_DCHECK(!window.empty() && intersect(window, film.bounds()) == window);
  ResolvedTile tile;
  tile.window = window;
  tile.invalid_samples = film.invalid_in(window) + (film.splats() ? film.splats()->invalid_in(window) : 0);
  const auto area = std::size_t(window.area());
  for (std::vector<float>& channel : tile.radiance) channel.reserve(area);
  if (channels & kResolveSamples) tile.samples.reserve(area);
  const auto visit_row = [&](const PixelRow& row) {
    row.append_means(window.x0, window.x1, tile.radiance);
    if (channels & kResolveSamples) row.append_samples(window.x0, window.x1, tile.samples);
  };
  if (channels & kResolveVariance) {
    pool_variance(film, window, intersect(roi, film.bounds()), visit_row, tile.variance);
    if (film.history()) add_bias(film, window, tile.variance);
  } else {
    thread_local PixelRow row;
    for (int y = window.y0; y < window.y1; ++y) {
      row.look(film, y, window.x0, window.x1);
      visit_row(row);
    }
  }
  for (const Channel& channel : channel_table()) {
    if (channel.resolve && channel.in(channels)) channel.resolve(film, mean_samples, tile);
  }
  return tile;
}

}  // namespace helio
