#include "renderer/film/allocation/sample_demand.h"

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <vector>

#include "renderer/film/core/box_rows.h"
#include "renderer/film/history/film_history.h"
#include "renderer/film/history/splat_row.h"

namespace helio {
namespace {

constexpr double kLargest = 1e36;  // times 49 it is a float

// Of one of the pixel's samples without its splats (of those that it carries, with them): precondition: it has two.
double variance_of_sample(const HalfPixel& pixel, const SplatRow& splats, int x, int c) {
  return std::max(0.0, pixel.deviations[c] + splats.deviation(x, c)) / (pixel.count - 1.0);
}

}  // namespace

double log_demand(const PixelDemand& demand) {
  return 0.5 * std::log2(std::clamp(demand.squared / demand.cost, 0x1p-90, 0x1p90));
}

std::uint32_t power_of_two_below(double x) {
  return std::bit_floor(std::uint32_t(std::clamp(x, 1.0, double(1u << 30))));
}

void find_demand(const Film& film, const PixelRect& region, const PixelRect& window, int h, AllocationMeasure measure,
                 double epsilon, DemandPixels pixels,
                 const std::function<void(int x, int y, const PixelDemand& demand)>& visit) {
  const int seen = 1 - h;
  thread_local BoxRows deviations;
  thread_local std::vector<float> sums;
  thread_local SplatRow splats, own_splats;
  deviations.begin(window.width());
  sums.resize(std::size_t(round_up_to_vectors(window.width())) * kLanes);
  // Of a pixel with samples: what squares of its deviations are over.
  const auto scale_of = [&](const HalfPixel& pixel, const SplatRow& row, int x, int c) {
    if (measure == AllocationMeasure::absolute) return 1.0;
    const double mean = std::clamp(pixel.sum[c] / pixel.count + row.mean(x, c), -kLargest, kLargest);
    return std::max(mean * mean + epsilon, DBL_MIN);
  };

  const PixelRect border = with_box_border(window);
  const PixelRect read = intersect(border, region);
  for (int below = border.y0; below < border.y1; ++below) {
    const bool inside = below >= read.y0 && below < read.y1;
    if (inside) splats.look(film, seen, below, read.x0, read.x1, true);
    for (int x = read.x0; inside && x < read.x1; ++x) {
      const HalfPixel& pixel = film.half(seen, x, below);
      float* deviation = deviations.input() + (x - border.x0) * kLanes;
      const bool left_out = pixels == DemandPixels::fresh && film.history()->carried(x, below).count[seen] > 0;
      const bool known = pixel.count > 1 && !left_out;
      deviation[3] = known ? 1.0f : 0.0f;
      for (int c = 0; c < 3; ++c) {
        deviation[c] =
            known ? float(std::min(
                        std::sqrt(variance_of_sample(pixel, splats, x, c) / scale_of(pixel, splats, x, c)), kLargest))
                  : 0.0f;
      }
    }
    deviations.push(inside);

    const int y = below - kBoxRadius;
    if (y < window.y0) continue;
    deviations.sum(sums.data());
    splats.look(film, seen, y, window.x0, window.x1, true);
    own_splats.look(film, h, y, window.x0, window.x1, true);
    for (int x = window.x0; x < window.x1; ++x) {
      const std::size_t i = std::size_t(x - window.x0) * kLanes;
      const double n = std::max(sums[i + 3], 1.0f);
      const HalfPixel &own = film.half(h, x, y), &other = film.half(seen, x, y);
      PixelDemand demand;
      demand.known = sums[i + 3] > 0;
      for (int c = 0; c < 3; ++c) {
        const double deviation = sums[i + std::size_t(c)] / n;
        demand.squared += deviation * deviation;
        if (own.count < 2) continue;
        const double scale = other.count > 0 ? scale_of(other, splats, x, c) : scale_of(own, own_splats, x, c);
        demand.own_squared += variance_of_sample(own, own_splats, x, c) / scale;
      }
      const BlockWork work = film.work(seen, x, y);
      if (work.paths > 0) demand.cost = std::max(1.0, double(work.rays) / double(work.paths));
      visit(x, y, demand);
    }
  }
}

double sum_of_means(const Film& film, const PixelRect& window, int half) {
  double sum = 0;
  SplatRow splats;
  for (int y = window.y0; y < window.y1; ++y) {
    splats.look(film, half, y, window.x0, window.x1, false);
    for (int x = window.x0; splats.any() && x < window.x1; ++x) {
      for (int c = 0; c < 3; ++c) sum += splats.mean(x, c);
    }
    for (int x = window.x0; x < window.x1; ++x) {
      const HalfPixel& pixel = film.half(half, x, y);
      if (pixel.count > 0) sum += (pixel.sum[0] + pixel.sum[1] + pixel.sum[2]) / pixel.count;
    }
  }
  return sum;
}

}  // namespace helio
