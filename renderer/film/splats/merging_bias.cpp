#include "renderer/film/splats/merging_bias.h"

#include <algorithm>
#include <cfloat>

#include "renderer/film/splats/splat_buffer.h"

namespace helio {

namespace {

double mean_luminance(const Film& film, const PixelRect& window) {
  double sum = 0;
  double splats[4 * kFilmBlock];
  for (int y = window.y0; y < window.y1; ++y) {
    for (int h = 0; h < kHalves && film.splats(); ++h) {
      film.splats()->read_row(h, y, window.x0, window.x1, splats);
      for (int x = 0; x < window.width(); ++x)
        sum += double(luminance(Rgb(V3d(splats[4 * x], splats[4 * x + 1], splats[4 * x + 2]))));
    }
    for (int x = window.x0; x < window.x1; ++x) {
      for (int h = 0; h < kHalves; ++h) {
        const HalfPixel& pixel = film.half(h, x, y);
        sum += double(luminance(Rgb(V3d(pixel.sum[0], pixel.sum[1], pixel.sum[2]) / double(pixel.count))));
      }
    }
  }
  return sum / (kHalves * double(window.area()));
}

}  // namespace

void MergingBias::add(const MergingBias& other) {
  pixels += other.pixels;
  for (int h = 0; h < kHalves; ++h) mean[h] += other.mean[h];
  squared += other.squared;
  relative += other.relative;
  squared_difference += other.squared_difference;
}

MergingBias merging_bias(const Film& film, const PixelRect& window, double epsilon) {
  MergingBias sums;
  for (int by = window.y0 / kFilmBlock * kFilmBlock; by < window.y1; by += kFilmBlock) {
    for (int bx = window.x0 / kFilmBlock * kFilmBlock; bx < window.x1; bx += kFilmBlock) {
      const PixelRect block = intersect({bx, by, bx + kFilmBlock, by + kFilmBlock}, window);
      const double area = double(block.area());
      double bias[kHalves];
      for (int h = 0; h < kHalves; ++h) {
        const BlockWork work = film.work(h, block.x0, block.y0);
        bias[h] = work.paths > 0 ? work.bias / double(work.paths) : 0;
        sums.mean[h] += area * bias[h];
      }
      const double level = mean_luminance(film, block);
      const double squared = area * bias[0] * bias[1], difference = area * (bias[0] - bias[1]);
      sums.pixels += area;
      sums.squared += squared;
      sums.relative += squared / std::max(level * level + epsilon, DBL_MIN);
      sums.squared_difference += difference * difference;
    }
  }
  return sums;
}

}  // namespace helio
