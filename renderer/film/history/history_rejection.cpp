#include "renderer/film/history/history_rejection.h"

#include <algorithm>
#include <cmath>

#include "renderer/base/check.h"
#include "renderer/film/core/box_rows.h"
#include "renderer/film/core/film_windows.h"
#include "renderer/film/history/film_history.h"
#include "renderer/film/history/splat_row.h"

namespace helio {
namespace {

constexpr double kDeviations = 4;
constexpr double kUnexpected = 0.25;
constexpr double kLargestBias2 = 1e38;
constexpr double kLargest = 1e15;  // of a difference: sums of the fourth powers of a neighbourhood are no floats

// Both halves' splats along a row.
struct Splats {
  SplatRow half[kHalves];
  void look(const Film& film, int y, int x0, int x1) {
    for (int h = 0; h < kHalves; ++h) half[h].look(film, h, y, x0, x1, true);
  }
};

// Product of the halves' differences, and its variance by chance, means over the channels; false: a half lacks fresh
// or carried samples.
bool compare(const Film& film, const Splats& splats, int x, int y, double& product, double& by_chance) {
  const CarriedPixel& carried = film.history()->carried(x, y);
  double inverse[kHalves];  // 1 / fresh + 1 / carried
  std::uint32_t fresh[kHalves];
  for (int h = 0; h < kHalves; ++h) {
    if (carried.count[h] == 0) return false;
    fresh[h] = film.half(h, x, y).count - carried.count[h];
    if (fresh[h] == 0) return false;
    inverse[h] = 1.0 / fresh[h] + 1.0 / carried.count[h];
  }
  const Rgb means[kHalves] = {carried.means.mean(0), carried.means.mean(1)};
  product = by_chance = 0;
  for (int c = 0; c < 3; ++c) {
    double difference[kHalves], variance = inverse[0] * inverse[1];
    for (int h = 0; h < kHalves; ++h) {
      const HalfPixel& half = film.half(h, x, y);
      const double mean = double(means[h][c]);
      const double splat = splats.half[h].mean(x, c) * half.count;  // its share is that of the fresh samples
      const double fresh_mean = (half.sum[c] - carried.count[h] * mean + splat) / fresh[h];
      difference[h] = std::clamp(fresh_mean - mean, -kLargest, kLargest);
      variance *= std::min(splats.half[h].sample_variance(half, x, c), kLargest);
    }
    product += difference[0] * difference[1] / 3;
    by_chance += variance / 3;
  }
  return true;
}

// In seven significant bits.
void note_bias2(CarriedPixel& carried, float bias2) {
  carried.set_found(pack_short_float(bias2) >> 1);
}
float noted_bias2(const CarriedPixel& carried) {
  return unpack_short_float(std::uint16_t(carried.found() << 1));
}

// What is inside the groups of carried and fresh samples is scaled, and what the half's deviations take for a
// difference between them is that of what is left. `before`: of the half before anything was taken back.
void scale_deviations(const Film& film, const SplatRow& before, double factor, int h, int x, int y, HalfPixel& half) {
  thread_local SplatRow now;
  now.look(film, h, y, x, x + 1, true);
  for (int c = 0; c < 3; ++c) {
    const double whole = std::max(0.0, half.deviations[c] + before.deviation(x, c)) * factor;
    half.deviations[c] = float(std::clamp(whole - now.deviation(x, c), 0.0, 0x1p127));
  }
}

}  // namespace

HistoryRejection::HistoryRejection(Film& film, const PixelRect& region)
    : film_(film), region_(intersect(region, film.bounds())) {
  HELIO_DCHECK(film.history() && !region_.empty());
  constexpr int kRows = 2 * kFilmBlock, kColumns = 16 * kFilmBlock;
  windows_ = cut_aligned(region_, kColumns, kRows);
  taken_.resize(windows_.size());
}

void HistoryRejection::run(int sweep, std::size_t part) {
  if (sweep == 0) {
    look(windows_[part]);
  } else {
    taken_[part] = take_back(windows_[part]);
  }
}

void HistoryRejection::look(const PixelRect& window) {
  thread_local BoxRows rows;
  thread_local std::vector<float> sums;
  thread_local Splats splats;
  rows.begin(window.width());
  sums.resize(std::size_t(round_up_to_vectors(window.width())) * kLanes);
  const PixelRect border = with_box_border(window);
  const PixelRect read = intersect(border, region_);
  for (int below = border.y0; below < border.y1; ++below) {
    const bool inside = below >= read.y0 && below < read.y1;
    if (inside) splats.look(film_, below, read.x0, read.x1);
    for (int x = read.x0; inside && x < read.x1; ++x) {
      float* term = rows.input() + (x - border.x0) * kLanes;
      double product = 0, by_chance = 0;
      const bool known = compare(film_, splats, x, below, product, by_chance);
      term[0] = float(product);
      term[1] = float(by_chance);
      term[2] = known ? float(film_.history()->carried(x, below).bias2) : 0.0f;
      term[3] = known ? 1.0f : 0.0f;
    }
    rows.push(inside);
    const int y = below - kBoxRadius;
    if (y < window.y0) continue;
    rows.sum(sums.data());
    splats.look(film_, y, window.x0, window.x1);
    for (int x = window.x0; x < window.x1; ++x) {
      const float* sum = sums.data() + (x - window.x0) * kLanes;
      double own = 0, own_chance = 0;
      const bool known = compare(film_, splats, x, y, own, own_chance);
      const double own_bias2 = known ? double(film_.history()->carried(x, y).bias2) : 0;
      const double pixels = double(sum[3]) - (known ? 1 : 0);
      const double product = double(sum[0]) - own, expected = std::max(0.0, double(sum[2]) - own_bias2);
      const double chance = std::max(0.0, double(sum[1]) - own_chance);
      CarriedPixel& carried = film_.history()->carried(x, y);
      carried.set_found(0);
      if (!(pixels > 0 && product - expected > kDeviations * std::sqrt(chance))) continue;
      // Spread over the neighbourhood as it was expected there, but for a part that nobody expected.
      const double measured = product / pixels, floor = kUnexpected * measured;
      const double own_part = (double(carried.bias2) + floor) / (expected / pixels + floor);
      note_bias2(carried, float(std::min(measured * own_part, kLargestBias2)));
    }
  }
}

double HistoryRejection::take_back(const PixelRect& window) {
  thread_local Splats splats;
  double taken = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    splats.look(film_, y, window.x0, window.x1);
    for (int x = window.x0; x < window.x1; ++x) {
      CarriedPixel& carried = film_.history()->carried(x, y);
      const float bias2 = noted_bias2(carried);
      if (!(bias2 > carried.bias2)) continue;
      double variance[kHalves] = {0, 0};
      for (int h = 0; h < kHalves; ++h) {
        for (int c = 0; c < 3; ++c) variance[h] += splats.half[h].sample_variance(film_.half(h, x, y), x, c) / 3;
      }
      for (int h = 0; h < kHalves; ++h) {
        if (carried.count[h] == 0) continue;
        const double n = carried.count[h], v = variance[1 - h];
        const double more = double(bias2) - double(carried.bias2);
        HalfPixel& half = film_.half(h, x, y);
        const std::uint32_t least = half.count > carried.count[h] ? 0 : 1;  // there is nothing else to show
        const std::uint32_t keep = std::max(std::uint32_t(v > 0 ? n / (1 + n * more / v) : 0.0), least);
        const std::uint32_t drop = carried.count[h] - keep;
        const double before = half.count;
        half.count -= drop;
        const double left = half.count > 1 ? (half.count - 1.0) / (before - 1.0) : 0.0;
        const Rgb mean = carried.means.mean(h);
        // What is left beside a sum of much brighter light is as exact as that sum.
        for (int c = 0; c < 3; ++c) half.sum[c] = std::max(0.0, half.sum[c] - double(mean[c]) * drop);
        carried.count[h] = keep;
        if (!film_.splats()) {
          for (float& deviations : half.deviations) deviations *= float(left);
        } else {
          scale_deviations(film_, splats.half[h], left, h, x, y, half);
        }
        taken += drop;
      }
      carried.bias2 = bias2;
    }
  }
  return taken;
}

}  // namespace helio
