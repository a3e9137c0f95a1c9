// The picture's error from the differences of its halves.
//
// Squared error of a pixel's mean: d = ((A - B) / 2)^2, unbiased whatever the sampler (variance_pool.h). Relative
// error needs the true radiance r under it. The pixel's own mean will not do: where noise is skewed it is large exactly
// where d is large, and the estimate comes out up to 2x too small at 4 samples; a pooled d over the pixel's own mean
// comes out too large at edges by more. The mean over the 7x7 neighbourhood as r was within 3 % on the bench scenes
// down to a relMSE of 0.3 (synthetic gamma noise with their means and variances, 4 to 64 samples). A pixel that both
// halves see much brighter than what is around it, as the rim of a small light, is weighed by its own mean: by that of
// its neighbourhood the relative error of Veach's plates came out at 1.5 times the true one.
#include <algorithm>
#include <array>
#include <cfloat>
#include <limits>

#include "renderer/base/check.h"
#include "renderer/film/core/box_rows.h"
#include "renderer/film/estimate/error_estimate.h"
#include "renderer/film/estimate/pixel_row.h"
#include "renderer/film/estimate/resolve.h"
#include "renderer/film/history/film_history.h"
#include "renderer/film/history/splat_row.h"
#include "renderer/film/splats/splat_buffer.h"

namespace helio {
namespace {

constexpr int kTileSide = 32;
// A pixel stands out where both halves are this many times the mean around it. Of exponential noise, one sample in a
// half, 2 % of the pixels do by chance; along a straight edge none does.
constexpr double kStandsOut = 2;
constexpr int kTilesPerBlock = 16;  // columns of tiles looked at together, to bound the scratch memory

bool reflects(const PixelFeatures& features) {
  return features.hits > 0 && (features.albedo[0] > 0 || features.albedo[1] > 0 || features.albedo[2] > 0);
}

// Adds the window's pixels, whose halves all have samples, to the sums of the tiles: column x belongs to
// tiles[min((x - window.x0) / 32, last)].
void add_window(const Film& film, const PixelRect& window, const PixelRect& roi, double epsilon,
                std::vector<ErrorEstimate::Sums>& tiles) {
  thread_local PixelRow row;
  thread_local BoxRows means;
  thread_local std::vector<float> sums;
  thread_local SplatRow splats[kHalves];
  means.begin(window.width());
  sums.resize(std::size_t(round_up_to_vectors(window.width())) * kLanes);
  const PixelRect border = with_box_border(window);
  const PixelRect read = intersect(border, roi);
  for (int below = border.y0; below < border.y1; ++below) {
    const bool inside = below >= read.y0 && below < read.y1;
    if (inside) {
      row.look(film, below, read.x0, read.x1);
      row.copy_means(FLT_MAX / 64, means.input() + (read.x0 - border.x0) * kLanes);
    }
    means.push(inside);
    const int y = below - kBoxRadius;
    if (y < window.y0) continue;
    means.sum(sums.data());
    const float* sum = sums.data();
    for (int h = 0; h < kHalves; ++h) splats[h].look(film, h, y, window.x0, window.x1, false);
    for (int x = window.x0; x < window.x1; ++x, sum += kLanes) {
      const HalfPixel& a = film.half(0, x, y);
      const HalfPixel& b = film.half(1, x, y);
      const double inv_a = 1.0 / a.count;
      const double inv_b = a.count == b.count ? inv_a : 1.0 / b.count;
      ErrorEstimate::Sums& tile = tiles[std::min(std::size_t((x - window.x0) / kTileSide), tiles.size() - 1)];
      if (sum[0] + sum[1] + sum[2] == 0 && reflects(film.features(x, y))) {
        const double samples = double(a.count) + double(b.count);
        tile.unproven += 1;
        tile.unproven_samples += samples;
        tile.unproven_inverse += 1 / samples;
      }
      const double bias2 = film.history() ? film.history()->bias2(x, y, a.count, b.count) : 0;
      for (int c = 0; c < 3; ++c) {
        double mean_a = a.sum[c] * inv_a, mean_b = b.sum[c] * inv_b;
        if (film.splats()) {
          mean_a += splats[0].mean(x, c);
          mean_b += splats[1].mean(x, c);
        }
        const double half_difference = 0.5 * (mean_a - mean_b);
        const double around = double(sum[c]) / sum[3];
        const bool stands_out = std::min(mean_a, mean_b) > kStandsOut * around;
        const double r = stands_out ? 0.5 * (mean_a + mean_b) : around;
        const double squared = half_difference * half_difference + bias2;
        tile.squared += squared;
        tile.relative += squared / std::max(r * r + epsilon, DBL_MIN);
      }
    }
  }
}

// Cuts [begin, end) into pieces of `size`; what is left over lengthens the last one.
std::vector<std::array<int, 2>> cut(int begin, int end, int size) {
  const int n = std::max(1, (end - begin) / size);
  std::vector<std::array<int, 2>> pieces;
  for (int i = 0; i < n; ++i) pieces.push_back({begin + i * size, i + 1 == n ? end : begin + (i + 1) * size});
  return pieces;
}

}  // namespace

ErrorEstimate::ErrorEstimate(const Film& film, const PixelRect& region)
    : film_(&film), roi_(intersect(region, film.bounds())) {
  HELIO_DCHECK(!roi_.empty());
  for (const auto [y0, y1] : cut(roi_.y0, roi_.y1, kTileSide)) {
    for (const auto [x0, x1] : cut(roi_.x0, roi_.x1, kTileSide * kTilesPerBlock)) {
      Part part;
      part.window = {x0, y0, x1, y1};
      part.tiles.resize(std::size_t(std::max(1, part.window.width() / kTileSide)));
      parts_.push_back(std::move(part));
    }
  }
}

void ErrorEstimate::run(int sweep, std::size_t part) {
  if (sweep == 0) {
    look_over(part);
  } else {
    add_up(part);
  }
}

void ErrorEstimate::finish_sweep(int sweep) {
  if (sweep == 0) finish_look();
}

void ErrorEstimate::look_over(std::size_t index) {
  Part& part = parts_[index];
  thread_local PixelRow row;
  // There are about as many light paths as samples of pixels that have them, so that a splat of their area's worth of
  // radiance is a sample's.
  const LightTiles* tiles = film_->light_tiles().get();
  const double light_paths = tiles ? std::max(tiles->pixels_in(roi_), 1.0) : double(roi_.area());
  for (int y = part.window.y0; y < part.window.y1; ++y) {
    row.look(*film_, y, part.window.x0, part.window.x1);
    part.paired &= !row.any_unpaired();
    part.radiance += row.sum_of_means();
    if (film_->splats()) {
      const double splat = film_->splats()->brightest(y, part.window.x0, part.window.x1) / light_paths;
      part.brightest = std::max(part.brightest, splat);
    }
    for (int h = 0; h < kHalves; ++h) {
      const HalfPixel* pixels = &film_->half(h, 0, y);
      for (int x = part.window.x0; x < part.window.x1; ++x) {
        const HalfPixel& pixel = pixels[x];
        for (int c = 0; c < 3; ++c) {
          // sum of squares > brightest x sum, without a division. No sample is above the sum; a carried pixel's sum may
          // have rounded to 0 beside squares that have not.
          const double sum = pixel.sum[c], n = pixel.count;
          if (n * pixel.deviations[c] + sum * sum > n * part.brightest * sum) {
            const double largest = std::min(pixel.sum_squares(c) / std::max(sum, DBL_MIN), sum);
            part.brightest = std::max(part.brightest, largest);
          }
        }
      }
    }
  }
}

void ErrorEstimate::finish_look() {
  double radiance = 0;
  for (const Part& part : parts_) {
    paired_ &= part.paired;
    brightest_ = std::max(brightest_, part.brightest);
    radiance += part.radiance;
  }
  const double mean = radiance / (3.0 * double(roi_.area()));
  epsilon_ = kRelativeEpsilon * mean * mean;
}

void ErrorEstimate::add_up(std::size_t index) {
  if (!paired_) return;
  add_window(*film_, parts_[index].window, roi_, epsilon_, parts_[index].tiles);
  if (film_->state().merging) parts_[index].bias = merging_bias(*film_, parts_[index].window, epsilon_);
}

FilmError ErrorEstimate::result() const {
  FilmError error;
  error.known = paired_;
  if (!error.known) {
    error.rmse = error.relmse = error.worst_tile_rmse = error.hidden_rmse = error.hidden_relmse =
        std::numeric_limits<double>::infinity();
    return error;
  }
  Sums total;
  MergingBias bias;
  for (const Part& part : parts_) {
    bias.add(part.bias);
    for (std::size_t i = 0; i < part.tiles.size(); ++i) {
      const Sums& tile = part.tiles[i];
      const int columns = i + 1 == part.tiles.size() ? part.window.width() - int(i) * kTileSide : kTileSide;
      const double values = 3.0 * columns * part.window.height();
      error.worst_tile_rmse = std::max(error.worst_tile_rmse, std::sqrt(tile.squared / values));
      total.squared += tile.squared;
      total.relative += tile.relative;
      total.unproven += tile.unproven;
      total.unproven_samples += tile.unproven_samples;
      total.unproven_inverse += tile.unproven_inverse;
    }
  }
  const double values = 3.0 * double(roi_.area());
  if (bias.pixels > 0) {
    error.bias = 0.5 * (bias.mean[0] + bias.mean[1]) / bias.pixels;
    error.bias_error = 0.5 * std::sqrt(bias.squared_difference) / bias.pixels;
    // All channels are taken to be off by as much as the luminance is.
    total.squared += 3 * std::max(0.0, bias.squared);
    total.relative += 3 * std::max(0.0, bias.relative);
  }
  error.rmse = std::sqrt(total.squared / values);
  error.relmse = total.relative / values;
  if (total.unproven > 0) {
    // Of a share p of bright samples L, each of n in a pixel, the pixel's mean has the variance p L^2 / n.
    const double share = 3 / total.unproven_samples;
    const double hidden = brightest_ > 0
                              ? share * brightest_ * brightest_ * total.unproven_inverse / double(roi_.area())
                              : std::numeric_limits<double>::infinity();
    error.unproven = total.unproven / double(roi_.area());
    error.hidden_rmse = std::sqrt(hidden);
    error.hidden_relmse = hidden / std::max(epsilon_, DBL_MIN);
  }
  return error;
}

FilmError estimate_error(const Film& film, const PixelRect& roi) {
  ErrorEstimate estimate(film, roi);
  for (int sweep = 0; sweep < estimate.sweeps(); ++sweep) {
    for (std::size_t part = 0; part < estimate.parts(); ++part) estimate.run(sweep, part);
    estimate.finish_sweep(sweep);
  }
  return estimate.result();
}

}  // namespace helio
