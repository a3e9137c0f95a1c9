#include "renderer/film/resolve.h"

#include <cassert>
#include <cfloat>

#include "renderer/film/variance_pool.h"

namespace helio {
namespace {

float to_float(double x) {
  return float(std::min(std::max(x, -double(FLT_MAX)), double(FLT_MAX)));
}

// Equal weight of the halves that have samples. Neighbours mostly have equal counts, so the divisions are kept.
struct HalfWeights {
  std::uint32_t count_a = 0, count_b = 0;
  double a = 0, b = 0;  // a.sum * a + b.sum * b is the mean

  void update(std::uint32_t new_a, std::uint32_t new_b) {
    if (new_a == count_a && new_b == count_b) return;
    count_a = new_a;
    count_b = new_b;
    const double weight = new_a > 0 && new_b > 0 ? 0.5 : 1.0;
    a = new_a > 0 ? weight / new_a : 0.0;
    b = new_b > 0 ? weight / new_b : 0.0;
  }
};

// Radiance, invalid samples and, when asked for, sample counts: what one look at the halves gives.
void resolve_halves(const Film& film, bool samples, ResolvedTile& tile) {
  const PixelRect& window = tile.window;
  const std::size_t width = std::size_t(window.width());
  for (std::vector<float>& channel : tile.radiance) channel.resize(std::size_t(window.area()));
  if (samples) tile.samples.resize(std::size_t(window.area()));
  HalfWeights weights;
  for (int y = window.y0; y < window.y1; ++y) {
    const HalfPixel* a = &film.half(0, window.x0, y);
    const HalfPixel* b = &film.half(1, window.x0, y);
    const std::size_t row = std::size_t(y - window.y0) * width;
    float* out[3];
    for (int c = 0; c < 3; ++c) out[c] = tile.radiance[c].data() + row;
    if (samples) {
      for (std::size_t x = 0; x < width; ++x) tile.samples[row + x] = float(a[x].count) + float(b[x].count);
    }
    for (std::size_t x = 0; x < width; ++x) {
      weights.update(a[x].count, b[x].count);
      for (int c = 0; c < 3; ++c) out[c][x] = to_float(a[x].sum[c] * weights.a + b[x].sum[c] * weights.b);
      tile.invalid_samples += a[x].invalid + std::uint64_t(b[x].invalid);
    }
  }
}

template <class Value>
void fill(const PixelRect& window, std::vector<float>& out, const Value& value) {
  out.resize(std::size_t(window.area()));
  std::size_t i = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) out[i++] = value(x, y);
  }
}

}  // namespace

Rgb resolve_mean(const Film& film, int x, int y) {
  const HalfPixel& a = film.half(0, x, y);
  const HalfPixel& b = film.half(1, x, y);
  HalfWeights weights;
  weights.update(a.count, b.count);
  Rgb mean;
  for (int c = 0; c < 3; ++c) mean[c] = to_float(a.sum[c] * weights.a + b.sum[c] * weights.b);
  return mean;
}

ResolvedTile resolve_tile(const Film& film, const PixelRect& window, const PixelRect& roi, unsigned channels) {
  assert(!window.empty() && intersect(window, film.bounds()) == window);
  ResolvedTile tile;
  tile.window = window;
  // First, because it reads the most: what follows finds the halves in the cache.
  if (channels & kResolveVariance) pool_variance(film, window, intersect(roi, film.bounds()), tile.variance);
  resolve_halves(film, channels & kResolveSamples, tile);
  // Features without samples: black, no normal, no coverage.
  const auto scaled = [&film](int x, int y, auto member) {
    const PixelFeatures& f = film.features(x, y);
    return f.count > 0 ? member(f) / float(f.count) : 0.0f;
  };
  if (channels & kResolveAlpha) {
    fill(window, tile.alpha, [&](int x, int y) { return scaled(x, y, [](const auto& f) { return f.coverage; }); });
  }
  if (channels & kResolveDepth) {
    fill(window, tile.depth, [&](int x, int y) { return film.features(x, y).depth; });
  }
  for (int c = 0; c < 3; ++c) {
    if (channels & kResolveNormal) {
      fill(window, tile.normal[c],
           [&](int x, int y) { return scaled(x, y, [c](const auto& f) { return f.normal[c]; }); });
    }
    if (channels & kResolveAlbedo) {
      fill(window, tile.albedo[c],
           [&](int x, int y) { return scaled(x, y, [c](const auto& f) { return f.albedo[c]; }); });
    }
  }
  return tile;
}

}  // namespace helio
