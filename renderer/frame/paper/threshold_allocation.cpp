#include "renderer/frame/paper/threshold_allocation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/film/core/pixel_hash.h"
#include "renderer/film/core/sample_targets.h"
#include "renderer/film/history/film_history.h"
#include "renderer/frame/paper/paper_film.h"

namespace helio {
namespace {

// "A small value"; the paper gives none. It decides nothing but how soon a dark pixel counts as converged: a black one
// has eps / eps = 1 and is sampled in every iteration.
constexpr double kEpsilon = 1e-3;

// In [0, 1), of pixel and iteration.
double coin(int x, int y, std::uint32_t iteration, std::uint64_t seed) {
  const std::uint64_t key = pixel_bits(x, y) * 0x9e3779b97f4a7c15u + seed;
  return double(hash64(key + std::uint64_t(iteration) * 0xd1342543de82ef95u) >> 11) * 0x1p-53;
}

}  // namespace

double relative_deviation(const HalfPixel& a, const HalfPixel& b) {
  const double n = double(a.count) + double(b.count);
  if (n < 2) return std::numeric_limits<double>::infinity();
  double mean[3], variance = 0;
  for (int c = 0; c < 3; ++c) {
    mean[c] = (a.sum[c] + b.sum[c]) / n;
    // Chan et al. 1983: the deviations of both about their common mean.
    double deviations = double(a.deviations[c]) + double(b.deviations[c]);
    if (a.count > 0 && b.count > 0) {
      const double apart = a.sum[c] / a.count - b.sum[c] / b.count;
      deviations += apart * apart * a.count * b.count / n;
    }
    variance += deviations / (3 * (n - 1));  // eq. 11
  }
  const double luminance = 0.2126 * mean[0] + 0.7152 * mean[1] + 0.0722 * mean[2];
  return (std::sqrt(variance) + kEpsilon) / (luminance + kEpsilon);  // eq. 12
}

void ThresholdAllocation::run(int, std::size_t part) {
  SampleTargets& targets = *film_.targets();
  PaperFilm& kept = paper_film(film_);
  const PixelRect& w = windows_[part];
  const double falling = double(settings_.max_samples) - settings_.min_samples;
  const double tau = std::min(1.0, 1 - (double(iteration_) - settings_.min_samples) / falling);
  const FilmHistory* history = carried_ ? film_.history() : nullptr;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      const std::uint32_t has[kHalves] = {film_.attempted(0, x, y), film_.attempted(1, x, y)};
      std::uint64_t count = std::uint64_t(has[0]) + has[1];
      if (history) count += std::uint64_t(history->carried(x, y).count[0]) + history->carried(x, y).count[1];
      float& probability = kept.probability(x, y);
      const bool calculated = history && probability > 0;
      bool ready;
      if (iteration_ < settings_.max_samples) {
        ready = !calculated &&
                (count < settings_.min_samples || relative_deviation(film_.half(0, x, y), film_.half(1, x, y)) >= tau);
      } else {
        if (iteration_ == settings_.max_samples && !calculated)
          probability = float(double(count) / double(settings_.max_samples));
        ready = coin(x, y, iteration_, settings_.seed) <= probability;
      }
      const int next = has[0] <= has[1] ? 0 : 1;
      for (int h = 0; h < kHalves; ++h) targets.set_target(h, x, y, has[h] + (ready && h == next ? 1 : 0));
    }
  }
  note_targets(part);
}

void ThresholdAllocation::finish_sweep(int) {
  finish_round();
}

}  // namespace helio
