#include "tests/statistical/batch_comparison.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/statistical/z_test.h"

namespace helio::test {

namespace {

struct Mean {
  double value = 0, variance = 0;  // of the mean
  double freedom = 1;
};

Mean mean_of_region(const Batches& batches, const PixelRect& region, int channel) {
  const double n = double(batches.pictures.size());
  double sum = 0, squares = 0, shift = 0;
  for (std::size_t k = 0; k < batches.pictures.size(); ++k) {
    double mean = 0;
    for (int y = region.y0; y < region.y1; ++y) {
      for (int x = region.x0; x < region.x1; ++x)
        mean += batches.pictures[k][std::size_t(y) * std::size_t(batches.width) + std::size_t(x)][channel];
    }
    mean /= double(region.area());
    if (k == 0) shift = mean;
    sum += mean - shift;
    squares += (mean - shift) * (mean - shift);
  }
  return {shift + sum / n, std::max(0.0, squares - sum * sum / n) / (n * (n - 1)), n - 1};
}

// A standard normal where both means are of the same number; NaN where one is.
double normal_z(const Mean& a, const Mean& b, double floor) {
  const double variance = a.variance + b.variance;
  if (a.value == b.value) return 0;
  const double t = std::abs(a.value - b.value) / std::sqrt(variance + floor * floor);
  const double terms = a.variance * a.variance / a.freedom + b.variance * b.variance / b.freedom;
  const double freedom = terms > 0 ? variance * variance / terms : a.freedom + b.freedom;
  return (8 * freedom + 1) / (8 * freedom + 3) * std::sqrt(freedom * std::log1p(t * t / freedom));
}

class Worst {
 public:
  // True for a new one.
  bool add(double value) {
    if (value <= value_) return false;
    value_ = std::isnan(value) ? INFINITY : value;
    return true;
  }
  double value() const { return value_; }

 private:
  double value_ = 0;
};

}  // namespace

BatchComparison compare(const Batches& rendering, const Batches& reference) {
  const int w = reference.width, h = reference.height;
  const auto z_of = [&](const PixelRect& region, int channel, double relative_floor) {
    const Mean a = mean_of_region(rendering, region, channel), b = mean_of_region(reference, region, channel);
    return normal_z(a, b, relative_floor * std::abs(b.value));
  };
  BatchComparison result;

  const double pixel_bound = sidak_bound(kAlpha, 3.0 * w * h);
  std::size_t inside = 0;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      for (int c = 0; c < 3; ++c) inside += z_of({x, y, x + 1, y + 1}, c, kRelativeFloor) <= pixel_bound;
    }
  }
  result.pixels_inside = double(inside) / (3.0 * w * h);

  const int across = (w + kBatchTile - 1) / kBatchTile, down = (h + kBatchTile - 1) / kBatchTile;
  const double tile_bound = sidak_bound(kAlpha, 3.0 * across * down);
  Worst tile, edge, mean;
  for (int y = 0; y < h; y += kBatchTile) {
    for (int x = 0; x < w; x += kBatchTile) {
      const PixelRect region{x, y, std::min(x + kBatchTile, w), std::min(y + kBatchTile, h)};
      for (int c = 0; c < 3; ++c) {
        if (tile.add(z_of(region, c, kRounding) / tile_bound)) result.tile_x = x, result.tile_y = y;
      }
    }
  }
  result.worst_tile = tile.value();

  const PixelRect edges[] = {{0, 0, w, 1}, {0, h - 1, w, h}, {0, 0, 1, h}, {w - 1, 0, w, h}};
  const double edge_bound = sidak_bound(kAlpha, 3.0 * 4);
  for (const PixelRect& region : edges) {
    for (int c = 0; c < 3; ++c) edge.add(z_of(region, c, kRounding) / edge_bound);
  }
  result.worst_edge = edge.value();

  for (int c = 0; c < 3; ++c) {
    const PixelRect all{0, 0, w, h};
    const Mean a = mean_of_region(rendering, all, c), b = mean_of_region(reference, all, c);
    mean.add(z_of(all, c, kRounding) / 3);
    if (b.value == 0) continue;
    const double off = a.value / b.value - 1;
    if (std::abs(off) > std::abs(result.mean_off)) result.mean_off = off;
    result.standard_error = std::max(result.standard_error, std::sqrt(a.variance + b.variance) / std::abs(b.value));
  }
  result.worst_mean = mean.value();
  return result;
}

bool BatchComparison::passed() const {
  return pixels_inside >= kLeastShare && worst_tile <= 1 && worst_edge <= 1 && worst_mean <= 1;
}

std::string BatchComparison::to_string() const {
  char text[256];
  std::snprintf(text, sizeof text,
                "mean off by %+.3f %% +- %.3f %% (%.2f of 3 standard errors), %.2f %% of pixels inside, worst tile at "
                "%.2f of its bound (%d, %d), worst edge at %.2f",
                100 * mean_off, 100 * standard_error, worst_mean, 100 * pixels_inside, worst_tile, tile_x, tile_y,
                worst_edge);
  return text;
}

}  // namespace helio::test
