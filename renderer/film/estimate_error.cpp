// The picture's error from the differences of its halves.
//
// Squared error of a pixel's mean: d = ((A - B) / 2)^2, unbiased whatever the sampler (variance_pool.h). Relative
// error needs the true radiance r under it. The pixel's own mean will not do: where noise is skewed it is large exactly
// where d is large, and the estimate comes out up to 2x too small at 4 samples; a pooled d over the pixel's own mean
// comes out too large at edges by more. The mean over the 7x7 neighbourhood as r was within 3 % on the bench scenes
// down to a relMSE of 0.3 (synthetic gamma noise with their means and variances, 4 to 64 samples).
#include <array>
#include <cassert>
#include <cfloat>
#include <limits>

#include "renderer/film/box_sum.h"
#include "renderer/film/resolve.h"

namespace helio {
namespace {

constexpr int kTileSide = 32;
constexpr int kTilesPerBlock = 16;         // columns of tiles looked at together, to bound the scratch memory
constexpr double kRelativeEpsilon = 1e-2;  // quality.md: relMSE = (x - r)^2 / (r^2 + 1e-2 mean(r)^2)

// What every pixel must have, and the mean radiance of the picture over pixels and channels.
struct Overview {
  bool paired = true;
  bool all_zero = true;
  double mean = 0;
};

Overview look_over(const Film& film, const PixelRect& roi) {
  Overview overview;
  double total = 0;
  for (int y = roi.y0; y < roi.y1; ++y) {
    double row = 0;
    for (int x = roi.x0; x < roi.x1; ++x) {
      const HalfPixel& a = film.half(0, x, y);
      const HalfPixel& b = film.half(1, x, y);
      overview.paired &= a.count > 0 && b.count > 0;
      for (const HalfPixel* half : {&a, &b}) {
        overview.all_zero &= half->sum_squares[0] + half->sum_squares[1] + half->sum_squares[2] == 0;
      }
      const Rgb mean = resolve_mean(film, x, y);
      row += double(mean.x) + mean.y + mean.z;
    }
    total += row;
  }
  overview.mean = total / (3.0 * double(roi.area()));
  return overview;
}

struct ErrorSums {
  double squared = 0;   // of d
  double relative = 0;  // of d / (r^2 + epsilon)
};

// Adds the window's pixels, whose halves all have samples, to the sums of the tiles: column x belongs to
// tiles[min((x - window.x0) / 32, last)].
void add_window(const Film& film, const PixelRect& window, const PixelRect& roi, double epsilon,
                std::vector<ErrorSums>& tiles) {
  thread_local BoxPlane means, rows, sums;
  const PixelRect border = with_box_border(window);
  const PixelRect read = intersect(border, roi);
  means.clear(border.width(), border.height());
  for (int y = read.y0; y < read.y1; ++y) {
    float* out = means.row(y - border.y0) + (read.x0 - border.x0) * kBoxLanes;
    for (int x = read.x0; x < read.x1; ++x, out += kBoxLanes) {
      const Rgb mean = resolve_mean(film, x, y);
      for (int c = 0; c < 3; ++c) out[c] = std::min(mean[c], FLT_MAX / 64);
      out[3] = 1;
    }
  }
  box_sum(means, window.width(), window.height(), rows, sums);
  for (int y = window.y0; y < window.y1; ++y) {
    const float* sum = sums.row(y - window.y0);
    for (int x = window.x0; x < window.x1; ++x, sum += kBoxLanes) {
      const HalfPixel& a = film.half(0, x, y);
      const HalfPixel& b = film.half(1, x, y);
      const double inv_a = 1.0 / a.count;
      const double inv_b = a.count == b.count ? inv_a : 1.0 / b.count;
      ErrorSums& tile = tiles[std::min(std::size_t((x - window.x0) / kTileSide), tiles.size() - 1)];
      for (int c = 0; c < 3; ++c) {
        const double half_difference = 0.5 * (a.sum[c] * inv_a - b.sum[c] * inv_b);
        const double r = double(sum[c]) / sum[3];
        const double squared = half_difference * half_difference;
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

FilmError estimate_error(const Film& film, const PixelRect& region) {
  const PixelRect roi = intersect(region, film.bounds());
  assert(!roi.empty());
  const Overview overview = look_over(film, roi);
  FilmError error;
  error.all_zero = overview.all_zero;
  error.known = overview.paired;
  if (!error.known) {
    error.rmse = error.relmse = error.worst_tile_rmse = std::numeric_limits<double>::infinity();
    return error;
  }
  const double epsilon = kRelativeEpsilon * overview.mean * overview.mean;
  ErrorSums total;
  for (const auto [y0, y1] : cut(roi.y0, roi.y1, kTileSide)) {
    for (const auto [x0, x1] : cut(roi.x0, roi.x1, kTileSide * kTilesPerBlock)) {
      const PixelRect window{x0, y0, x1, y1};
      std::vector<ErrorSums> tiles(std::size_t(std::max(1, window.width() / kTileSide)));
      add_window(film, window, roi, epsilon, tiles);
      for (std::size_t i = 0; i < tiles.size(); ++i) {
        const int columns = i + 1 == tiles.size() ? window.width() - int(i) * kTileSide : kTileSide;
        const double values = 3.0 * columns * window.height();
        error.worst_tile_rmse = std::max(error.worst_tile_rmse, std::sqrt(tiles[i].squared / values));
        total.squared += tiles[i].squared;
        total.relative += tiles[i].relative;
      }
    }
  }
  const double values = 3.0 * double(roi.area());
  error.rmse = std::sqrt(total.squared / values);
  error.relmse = total.relative / values;
  return error;
}

}  // namespace helio
