#include "renderer/film/variance_pool.h"

#include <array>
#include <cassert>
#include <cfloat>
#include <cstddef>
#include <cstring>
#include <limits>

#include "renderer/film/box_sum.h"

namespace helio {
namespace {

constexpr int kPrefetchPixels = 32;  // in each half, 1.8 KiB ahead; measured: a third off the whole
// Terms are clamped so that 49 of them, times 25, stay finite, and so that a positive one stays positive.
constexpr double kLargestTerm = 1e34;

struct Scratch {
  BoxPlane differences, spreads;  // d and q of the header; the fourth lane is 1 where they are defined
  BoxPlane rows, difference_sums, spread_sums;
};

// Vectors of four: an extension of GCC that clang has too; they are split in two where the machine is narrower.
using Double4 = double __attribute__((vector_size(32)));
using Long4 = std::int64_t __attribute__((vector_size(32)));
using Float4 = float __attribute__((vector_size(16)));

// A half's moments, three channels each; the fourth lanes are finite and mean nothing.
struct Moments {
  Double4 sum, sum_squares;

  explicit Moments(const HalfPixel& half) {
    static_assert(offsetof(HalfPixel, sum) == 0 && offsetof(HalfPixel, sum_squares) == 3 * sizeof(double) &&
                  sizeof(HalfPixel) == 7 * sizeof(double));
    const char* bytes = reinterpret_cast<const char*>(&half);
    std::memcpy(&sum, bytes, sizeof(sum));  // lane 3: sum_squares[0]
    std::memcpy(&sum_squares, bytes + 3 * sizeof(double), sizeof(sum_squares));
    // Lane 3 holds the two counts, a subnormal number that would be slow to calculate with.
    sum_squares = (Double4)((Long4)sum_squares & Long4{-1, -1, -1, 0});
  }
};

void store_terms(const Double4& terms, float last, float* out) {
  const Double4 low = Double4{} + double(FLT_MIN), high = Double4{} + kLargestTerm;
  Double4 clamped = terms < low ? low : terms;
  clamped = clamped > high ? high : clamped;
  clamped = terms > 0.0 ? clamped : Double4{};
  Float4 narrow = __builtin_convertvector(clamped, Float4);
  narrow[3] = last;
  std::memcpy(out, &narrow, sizeof(narrow));
}

// What a pair of counts makes of moments. Neighbours mostly have equal counts, so the divisions are kept.
struct Weights {
  std::uint32_t count_a = 0, count_b = 0;
  double inv_a = 0, inv_b = 0;      // 1 / count
  double scale_a = 0, scale_b = 0;  // 1 / (4 count (count - 1)); both 0 when either half has fewer than two
  float known = 0;                  // 1: both halves have two or more

  void update(std::uint32_t a, std::uint32_t b) {
    if (a == count_a && b == count_b) return;
    count_a = a;
    count_b = b;
    inv_a = 1.0 / a;
    inv_b = 1.0 / b;
    const bool both = a > 1 && b > 1;
    scale_a = both ? 0.25 * inv_a / (a - 1.0) : 0;
    scale_b = both ? 0.25 * inv_b / (b - 1.0) : 0;
    known = both ? 1.0f : 0.0f;
  }
};

// d and q of one pixel with samples in both halves.
void gather_pixel(const HalfPixel& a, const HalfPixel& b, const Weights& w, float* difference, float* spread) {
  const Moments ma(a), mb(b);
  const Double4 half_difference = (ma.sum * w.inv_a - mb.sum * w.inv_b) * 0.5;
  store_terms(half_difference * half_difference, 1.0f, difference);
  const Double4 spread_a = ma.sum_squares - ma.sum * ma.sum * w.inv_a;
  const Double4 spread_b = mb.sum_squares - mb.sum * mb.sum * w.inv_b;
  store_terms((spread_a > 0.0 ? spread_a : Double4{}) * w.scale_a + (spread_b > 0.0 ? spread_b : Double4{}) * w.scale_b,
              w.known, spread);
}

// Returns whether some pixel lacks a half.
bool gather(const Film& film, const PixelRect& window, const PixelRect& roi, Scratch& s) {
  const PixelRect border = with_box_border(window);
  s.differences.clear(border.width(), border.height());
  s.spreads.clear(border.width(), border.height());
  const PixelRect read = intersect(border, roi);
  bool any_unpaired = false;
  Weights weights;
  for (int y = read.y0; y < read.y1; ++y) {
    const HalfPixel* a = &film.half(0, read.x0, y);
    const HalfPixel* b = &film.half(1, read.x0, y);
    float* difference = s.differences.row(y - border.y0) + (read.x0 - border.x0) * kBoxLanes;
    float* spread = s.spreads.row(y - border.y0) + (read.x0 - border.x0) * kBoxLanes;
    for (int i = 0; i < read.width(); ++i) {
      __builtin_prefetch(a + i + kPrefetchPixels);
      __builtin_prefetch(b + i + kPrefetchPixels);
      if (a[i].count > 0 && b[i].count > 0) {
        weights.update(a[i].count, b[i].count);
        gather_pixel(a[i], b[i], weights, difference + i * kBoxLanes, spread + i * kBoxLanes);
      } else {
        any_unpaired = true;
      }
    }
  }
  return any_unpaired;
}

// D (1/2 + 1/2 q/Q) from the sums over the neighbourhood and the pixel's own q; the fourth lane means nothing.
Float4 estimate(const float* difference_sums, const float* spread_sums, const float* spreads) {
  Float4 d, total, own;
  std::memcpy(&d, difference_sums, sizeof(d));
  std::memcpy(&total, spread_sums, sizeof(total));
  std::memcpy(&own, spreads, sizeof(own));
  const float n = d[3];
  Float4 pooled = d * (1.0f / std::max(n, 1.0f));
  if (n == total[3]) {
    const Float4 ratio = total > 0.0f ? own * n / total : Float4{1, 1, 1, 1};
    pooled *= 0.5f + 0.5f * ratio;
  }
  const Float4 low = Float4{} + FLT_MIN;
  return d > 0.0f ? (pooled < low ? low : pooled) : Float4{};
}

// Radiance of a pixel from the samples it has; false: none.
bool any_mean(const Film& film, int x, int y, double mean[3]) {
  const HalfPixel& a = film.half(0, x, y);
  const HalfPixel& b = film.half(1, x, y);
  if (a.count == 0 && b.count == 0) return false;
  for (int c = 0; c < 3; ++c) {
    if (a.count == 0) {
      mean[c] = b.sum[c] / b.count;
    } else if (b.count == 0) {
      mean[c] = a.sum[c] / a.count;
    } else {
      mean[c] = 0.5 * (a.sum[c] / a.count + b.sum[c] / b.count);
    }
  }
  return true;
}

// Half the squared difference to the right and the lower neighbour, averaged: the spatial term of one pixel.
void gather_spatial(const Film& film, const PixelRect& window, const PixelRect& roi, Scratch& s) {
  const PixelRect border = with_box_border(window);
  s.differences.clear(border.width(), border.height());
  const PixelRect read = intersect(border, roi);
  for (int y = read.y0; y < read.y1; ++y) {
    for (int x = read.x0; x < read.x1; ++x) {
      double here[3], there[3];
      Double4 sum = {};
      int neighbours = 0;
      if (!any_mean(film, x, y, here)) continue;
      for (const auto [nx, ny] : {std::array{x + 1, y}, std::array{x, y + 1}}) {
        if (!roi.contains(nx, ny) || !any_mean(film, nx, ny, there)) continue;
        ++neighbours;
        for (int c = 0; c < 3; ++c) sum[c] += 0.5 * (here[c] - there[c]) * (here[c] - there[c]);
      }
      if (neighbours == 0) continue;
      store_terms(sum / double(neighbours), 1.0f, s.differences.row(y - border.y0) + (x - border.x0) * kBoxLanes);
    }
  }
}

// Pixels that lack a half: the spatial estimate. Those without samples or outside the region: +infinity.
void fill_unpaired(const Film& film, const PixelRect& window, const PixelRect& roi, Scratch& s,
                   std::vector<float> variance[3]) {
  const int w = window.width(), h = window.height();
  gather_spatial(film, window, roi, s);
  box_sum(s.differences, w, h, s.rows, s.difference_sums);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const int px = window.x0 + x, py = window.y0 + y;
      const bool a = film.half(0, px, py).count > 0;
      const bool b = film.half(1, px, py).count > 0;
      const bool inside = roi.contains(px, py);
      if (a && b && inside) continue;
      const float* sums = s.difference_sums.row(y) + x * kBoxLanes;
      const bool estimated = (a || b) && sums[3] > 0 && inside;
      for (int c = 0; c < 3; ++c) {
        variance[c][std::size_t(y) * w + x] = estimated ? sums[c] / sums[3] : std::numeric_limits<float>::infinity();
      }
    }
  }
}

}  // namespace

void pool_variance(const Film& film, const PixelRect& window, const PixelRect& roi, std::vector<float> variance[3]) {
  assert(intersect(window, film.bounds()) == window && intersect(roi, film.bounds()) == roi);
  const int w = window.width(), h = window.height();
  thread_local Scratch s;  // kept: a tile's planes would cost more to allocate than to fill
  const bool any_unpaired = gather(film, window, roi, s);
  box_sum(s.differences, w, h, s.rows, s.difference_sums);
  box_sum(s.spreads, w, h, s.rows, s.spread_sums);
  for (int c = 0; c < 3; ++c) variance[c].resize(std::size_t(window.area()));
  for (int y = 0; y < h; ++y) {
    const float* differences = s.difference_sums.row(y);
    const float* spread_sums = s.spread_sums.row(y);
    const float* spreads = s.spreads.row(y + kBoxRadius) + kBoxRadius * kBoxLanes;
    float* out[3];
    for (int c = 0; c < 3; ++c) out[c] = variance[c].data() + std::size_t(y) * w;
    for (int x = 0; x < w; ++x) {
      const Float4 pooled = estimate(differences + x * kBoxLanes, spread_sums + x * kBoxLanes, spreads + x * kBoxLanes);
      for (int c = 0; c < 3; ++c) out[c][x] = pooled[c];
    }
  }
  const bool outside = intersect(window, roi) != window;
  if (any_unpaired || outside) fill_unpaired(film, window, roi, s, variance);
}

}  // namespace helio
