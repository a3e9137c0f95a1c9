#include "tests/statistical/z_test.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace helio::test {

namespace {

double floor_of(double reference) {
  return kRelativeFloor * std::abs(reference);
}

double normal_tail(double z) {  // P(|Z| > z)
  return std::erfc(z / std::sqrt(2.0));
}

}  // namespace

double sidak_bound(double alpha, double tests) {
  const double level = -std::expm1(std::log1p(-alpha) / tests);
  double low = 0, high = 40;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (normal_tail(middle) > level ? low : high) = middle;
  }
  return high;
}

ZTestResult z_test(const Estimate& rendering, const Estimate& reference) {
  ZTestResult result;
  const int w = reference.width, h = reference.height;
  const int across = (w + kTileSide - 1) / kTileSide, down = (h + kTileSide - 1) / kTileSide;
  const double pixel_bound = sidak_bound(kAlpha, 3.0 * w * h), tile_bound = sidak_bound(kAlpha, 3.0 * across * down);
  std::size_t inside = 0;
  for (int ty = 0; ty < h; ty += kTileSide) {
    for (int tx = 0; tx < w; tx += kTileSide) {
      for (int c = 0; c < 3; ++c) {
        double difference = 0, variance = 0, level = 0;
        for (int y = ty; y < std::min(h, ty + kTileSide); ++y) {
          for (int x = tx; x < std::min(w, tx + kTileSide); ++x) {
            const std::size_t i = std::size_t(y) * std::size_t(w) + std::size_t(x);
            const double d = rendering.mean[i][c] - reference.mean[i][c];
            const double ours = rendering.variance[i][c], theirs = reference.variance[i][c], v = ours + theirs;
            const double least = floor_of(reference.mean[i][c]);
            inside += std::abs(d) <= pixel_bound * std::sqrt(v + least * least);  // false for NaN
            difference += d;
            variance += ours * rendering.overlap + theirs * reference.overlap;
            level += reference.mean[i][c];
          }
        }
        const double deviation = std::hypot(std::sqrt(variance), floor_of(level));
        const double z = difference == 0 ? 0 : std::abs(difference) / deviation / tile_bound;
        if (!(z <= result.worst_tile)) {
          result.worst_tile = std::isnan(z) ? INFINITY : z;
          result.worst_x = tx;
          result.worst_y = ty;
          result.worst_channel = c;
        }
      }
    }
  }
  result.pixels_inside = double(inside) / (3.0 * w * h);
  return result;
}

std::string ZTestResult::to_string() const {
  char text[160];
  std::snprintf(text, sizeof text, "%.3f %% of pixels inside, worst tile at %.3f of its bound (%d, %d, channel %d)",
                100 * pixels_inside, worst_tile, worst_x, worst_y, worst_channel);
  return text;
}

}  // namespace helio::test
