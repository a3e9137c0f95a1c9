#include "renderer/film/history_source.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <initializer_list>

#include "renderer/film/packed_values.h"

namespace helio {
namespace {

constexpr float kLargest = 1e8f;  // of a mean over the albedo: squares of products of differences stay floats
// What mean_product() takes off a mean of nine equal products, given back.
constexpr float kKept = 1.5f;

// The halves' means over the albedo, of a window and two pixels around it.
struct Means {
  int x0 = 0, y0 = 0, width = 0;
  std::vector<float> values;       // six a pixel: half A, half B
  std::vector<std::uint8_t> kind;  // 0: nothing is known, or on a surface's border; 1: one half is known; 2: both are

  std::size_t at(int x, int y) const { return std::size_t(y - y0) * std::size_t(width) + std::size_t(x - x0); }
  const float* of(int x, int y) const { return values.data() + at(x, y) * 6; }
};

void read_means(const Film& film, const PixelRect& border, const PixelRect& region, Means& out) {
  out.x0 = border.x0;
  out.y0 = border.y0;
  out.width = border.width();
  out.values.resize(std::size_t(border.area()) * 6);
  out.kind.assign(std::size_t(border.area()), 0);
  const PixelRect known = intersect(border, region);
  std::uint32_t packed_albedo = ~0u;
  Rgb factor(1, 1, 1);
  for (int y = known.y0; y < known.y1; ++y) {
    for (int x = known.x0; x < known.x1; ++x) {
      const std::size_t i = out.at(x, y);
      const CentreHit& centre = film.history()->centre(x, y);
      const int halves = (film.half(0, x, y).count > 0) + (film.half(1, x, y).count > 0);
      if (halves == 0 || centre.border) continue;
      out.kind[i] = std::uint8_t(halves);
      if (halves < kHalves) continue;
      if (centre.albedo != packed_albedo) {
        packed_albedo = centre.albedo;
        const Rgb divisor = demodulation(unpack_reflectance(packed_albedo));
        factor = Rgb(1 / divisor.x, 1 / divisor.y, 1 / divisor.z);
      }
      for (int h = 0; h < kHalves; ++h) {
        const HalfPixel& half = film.half(h, x, y);
        const double inverse = 1.0 / half.count;
        for (int c = 0; c < 3; ++c) {
          const double mean = half.sum[c] * inverse * double(factor[c]);
          out.values[i * 6 + std::size_t(3 * h + c)] = float(std::clamp(mean, -double(kLargest), double(kLargest)));
        }
      }
    }
  }
}

// Products of the halves' differences around a pixel, mean over the channels, and how many there are: slope along x and
// y, bend along x and y.
constexpr int kProducts = 4;
struct Products {
  float sum[kProducts] = {}, squares[kProducts] = {}, count[kProducts] = {};
};

// Between pixels inside a surface.
Products products_at(const Means& means, int x, int y) {
  Products out;
  const auto inside = [&](int px, int py) { return means.kind[means.at(px, py)] == 2; };
  if (!inside(x, y)) return out;
  const float* here = means.of(x, y);
  for (int axis = 0; axis < 2; ++axis) {
    const int dx = axis == 0, dy = axis == 1;
    if (!inside(x + dx, y + dy)) continue;
    const float* after = means.of(x + dx, y + dy);
    for (int c = 0; c < 3; ++c) out.sum[axis] += (after[c] - here[c]) * (after[c + 3] - here[c + 3]) * (1.0f / 3);
    out.count[axis] = 1;
    if (!inside(x - dx, y - dy)) continue;
    const float* before = means.of(x - dx, y - dy);
    for (int c = 0; c < 3; ++c) {
      const float a = before[c] - 2 * here[c] + after[c], b = before[c + 3] - 2 * here[c + 3] + after[c + 3];
      out.sum[2 + axis] += a * b * (1.0f / 3);
    }
    out.count[2 + axis] = 1;
  }
  for (int i = 0; i < kProducts; ++i) out.squares[i] = out.sum[i] * out.sum[i];
  return out;
}

void add(const Products& from, Products& to) {
  for (int i = 0; i < kProducts; ++i) {
    to.sum[i] += from.sum[i];
    to.squares[i] += from.squares[i];
    to.count[i] += from.count[i];
  }
}

// Sums over 3x3 pixels, of a window; row-major.
void sum_products(const Means& means, const PixelRect& window, std::vector<Products>& out) {
  thread_local std::vector<Products> row;
  const int width = window.width();
  row.resize(std::size_t(width) + 2);
  out.assign(std::size_t(window.area()), Products{});
  for (int y = window.y0 - 1; y <= window.y1; ++y) {
    for (int i = 0; i < width + 2; ++i) row[std::size_t(i)] = products_at(means, window.x0 - 1 + i, y);
    for (int i = 0; i < width; ++i) {
      Products three = row[std::size_t(i)];
      add(row[std::size_t(i) + 1], three);
      add(row[std::size_t(i) + 2], three);
      for (int to = std::max(y - 1, window.y0); to <= std::min(y + 1, window.y1 - 1); ++to)
        add(three, out[std::size_t(to - window.y0) * std::size_t(width) + std::size_t(i)]);
    }
  }
}

// Mean of some products, less the standard error that it has: what fireflies make of them is mostly noise of either
// sign, and weights must not follow it.
float mean_product(const Products& products, std::initializer_list<int> kinds) {
  float sum = 0, squares = 0, count = 0;
  for (const int i : kinds) {
    sum += products.sum[i];
    squares += products.squares[i];
    count += products.count[i];
  }
  return count > 0 ? std::max(sum - std::sqrt(squares), 0.0f) * (kKept / count) : 0.0f;
}

}  // namespace

void HistorySource::gather(const Film& film, const PixelRect& window, const PixelRect& region) {
  thread_local Means means;
  thread_local std::vector<Products> sums;
  const PixelRect border = {window.x0 - 2, window.y0 - 2, window.x1 + 2, window.y1 + 2};
  read_means(film, border, region, means);
  sum_products(means, window, sums);
  auto products = sums.begin();
  const FilmHistory& history = *film.history();
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x, ++products) {
      SourcePixel& to = pixels_[index(x, y)];
      const HalfPixel& a = film.half(0, x, y);
      const HalfPixel& b = film.half(1, x, y);
      centres_[index(x, y)] = history.centre(x, y);
      to = {};
      if (a.count == 0 && b.count == 0) continue;
      const float sign = history.centre(x, y).border ? -1.0f : 1.0f;
      to.bias2 = float(std::min(history.bias2(x, y, a.count, b.count), double(FLT_MAX)));
      for (int h = 0; h < kHalves; ++h) {
        const HalfPixel& half = h == 0 ? a : b;
        const double inverse = half.count > 0 ? 1.0 / half.count : 0;
        to.inverse_count[h] = sign * float(inverse);
        for (int c = 0; c < 3; ++c) {
          to.mean[h][c] = float(std::clamp(half.sum[c] * inverse, -double(FLT_MAX), double(FLT_MAX)));
          const float spread = half.count > 1 ? half.deviations[c] / (float(half.count) - 1) : 0.0f;
          to.spread[h][c] = pack_short_float(std::min(spread, 1e36f));
        }
      }
      to.slope2 = pack_short_float(mean_product(*products, {0, 1}));
      for (int axis = 0; axis < 2; ++axis) to.bend2[axis] = pack_short_float(mean_product(*products, {2 + axis}));
      to.age = pack_short_float(float(history.weight(x, y, a.count, b.count)) * history.carried(x, y).age);
    }
  }
}

}  // namespace helio
