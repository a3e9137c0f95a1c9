#include "renderer/film/neyman_allocation.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cassert>
#include <cfloat>
#include <cmath>

#include "renderer/film/box_rows.h"
#include "renderer/film/sample_targets.h"

namespace helio {
namespace {

constexpr double kRelativeEpsilon = 1e-2;  // quality.md: relMSE = (x - r)^2 / (r^2 + 1e-2 mean(r)^2)
// Every pixel gets this share of the mean: what a pilot has missed is found, if late. It costs at most as much.
constexpr double kLeastShare = 1.0 / 8;
// And no more than this many times the mean, lest a pilot's single bright sample take the round.
constexpr double kMostShare = 64;

// Bins of the histogram: 1/128 of an octave over 96 octaves; what is outside counts as the outermost.
constexpr int kBinsPerOctave = 128;
constexpr int kOctaves = 96;
constexpr int kBins = kOctaves * kBinsPerOctave;
constexpr float kLowest = -float(kOctaves) / 2;

int bin_of(float demand) {
  return std::clamp(int(std::floor((demand - kLowest) * kBinsPerOctave)), 0, kBins - 1);
}

// In [0, 1), of the pixel.
float dither(int x, int y, std::uint64_t seed) {
  std::uint64_t z = (std::uint64_t(std::uint32_t(y)) << 32 | std::uint32_t(x)) + seed * 0x9e3779b97f4a7c15u;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;  // splitmix64's finaliser (Steele et al. 2014)
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return float((z ^ z >> 31) >> 40) * 0x1p-24f;
}

// The count that a bin shifted by the scale stands for, between `least` and `most`, both powers of two.
std::uint32_t count_of(int bin, int shift, std::uint32_t least, std::uint32_t most) {
  const int octave = (bin + shift) >= 0 ? (bin + shift) / kBinsPerOctave : -1;
  if (octave < 0 || octave >= 32) return octave < 0 ? least : most;
  return std::clamp(std::uint32_t(1) << octave, least, most);
}

std::uint32_t power_of_two_below(double x) {
  return std::bit_floor(std::uint32_t(std::clamp(x, 1.0, double(1u << 30))));
}

}  // namespace

NeymanAllocation::NeymanAllocation(Film& film, const PixelRect& region, const AllocationSettings& settings,
                                   const AllocationRequest& request)
    : SampleAllocation(film, region, film.targets()->demand_known ? 1 : 3), settings_(settings), request_(request) {
  for (std::vector<double>& sums : part_sums_) sums.resize(parts());
  const std::uint32_t pilot = settings.min_samples / 2;
  least_ = std::max(std::max(pilot, 1u), power_of_two_below(request.mean * kLeastShare));
  most_ = std::max(least_, power_of_two_below(request.mean * kMostShare));
  if (sweeps_ == 1) {
    solve();
  } else {
    for (std::vector<std::uint32_t>& histogram : film.targets()->histogram) histogram.assign(kBins, 0);
  }
}

NeymanAllocation::Sweep NeymanAllocation::kind(int sweep) const {
  if (sweep + 1 == sweeps_) return Sweep::assign;
  return sweep == 0 ? Sweep::means : Sweep::demand;
}

void NeymanAllocation::run(int sweep, std::size_t part) {
  switch (kind(sweep)) {
    case Sweep::means: return add_means(part);
    case Sweep::demand: return find_demand(part);
    case Sweep::assign: return assign(part);
  }
}

void NeymanAllocation::finish_sweep(int sweep) {
  switch (kind(sweep)) {
    case Sweep::means:
      for (int h = 0; h < kHalves; ++h) {
        double sum = 0;
        for (const double part : part_sums_[h]) sum += part;
        const double mean = sum / (3.0 * double(region_.area()));
        epsilon_[h] = settings_.measure == AllocationMeasure::relative ? kRelativeEpsilon * mean * mean : 1;
      }
      return;
    case Sweep::demand:
      film_.targets()->demand_known = true;
      solve();
      return;
    case Sweep::assign: finish_round(); return;
  }
}

void NeymanAllocation::add_means(std::size_t part) {
  const PixelRect& w = windows_[part];
  for (int h = 0; h < kHalves; ++h) {
    double sum = 0;
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) {
        const HalfPixel& pixel = film_.half(h, x, y);
        if (pixel.count > 0) sum += (pixel.sum[0] + pixel.sum[1] + pixel.sum[2]) / pixel.count;
      }
    }
    part_sums_[h][part] = sum;
  }
}

void NeymanAllocation::find_demand(std::size_t part) {
  for (int h = 0; h < kHalves; ++h) find_demand_of(h, windows_[part]);
}

// Of half h, from what the other one has seen.
void NeymanAllocation::find_demand_of(int h, const PixelRect& window) {
  SampleTargets& targets = *film_.targets();
  const int seen = 1 - h;
  thread_local BoxRows means, variances;
  thread_local std::vector<float> mean_sums, variance_sums;
  means.begin(window.width());
  variances.begin(window.width());
  const auto padded = std::size_t(round_up_to_vectors(window.width())) * kLanes;
  mean_sums.resize(padded);
  variance_sums.resize(padded);

  const PixelRect border = with_box_border(window);
  const PixelRect read = intersect(border, region_);
  for (int below = border.y0; below < border.y1; ++below) {
    const bool inside = below >= read.y0 && below < read.y1;
    for (int x = read.x0; inside && x < read.x1; ++x) {
      const HalfPixel& pixel = film_.half(seen, x, below);
      float* mean = means.input() + (x - border.x0) * kLanes;
      float* variance = variances.input() + (x - border.x0) * kLanes;
      const bool known = pixel.count > 1;
      mean[3] = variance[3] = known ? 1.0f : 0.0f;
      for (int c = 0; c < 3; ++c) {
        constexpr double kLargest = 1e18;  // its square, times 49, is a float
        mean[c] = known ? float(std::clamp(pixel.sum[c] / pixel.count, -kLargest, kLargest)) : 0.0f;
        variance[c] =
            known ? float(std::min(pixel.deviations[c] / (pixel.count - 1.0), kLargest * kLargest)) : 0.0f;
      }
    }
    means.push(inside);
    variances.push(inside);

    const int y = below - kBoxRadius;
    if (y < window.y0) continue;
    means.sum(mean_sums.data());
    variances.sum(variance_sums.data());
    for (int x = window.x0; x < window.x1; ++x) {
      const std::size_t i = std::size_t(x - window.x0) * kLanes;
      const double n = variance_sums[i + 3];
      double squared = 0;  // s^2
      for (int c = 0; c < 3 && n > 0; ++c) {
        const double variance = variance_sums[i + std::size_t(c)] / n, mean = mean_sums[i + std::size_t(c)] / n;
        const double scale = settings_.measure == AllocationMeasure::relative ? mean * mean + epsilon_[seen] : 1;
        squared += variance / std::max(scale, DBL_MIN);
      }
      const BlockWork work = film_.work(seen, x, y);
      const double cost = work.paths > 0 ? double(work.rays) / double(work.paths) : 1;
      const double ratio = std::clamp(squared / std::max(cost, 1.0), 0x1p-90, 0x1p90);
      const float demand = float(0.5 * std::log2(ratio)) + dither(x, y, settings_.seed);
      targets.demand(h, x, y) = demand;
      std::atomic_ref(targets.histogram[h][std::size_t(bin_of(demand))]).fetch_add(1, std::memory_order_relaxed);
    }
  }
}

double NeymanAllocation::mean_count(int h, int shift) const {
  const std::vector<std::uint32_t>& histogram = film_.targets()->histogram[h];
  double sum = 0;
  for (int bin = 0; bin < kBins; ++bin) {
    if (const std::uint32_t pixels = histogram[std::size_t(bin)])
      sum += double(pixels) * count_of(bin, shift, least_, most_);
  }
  return sum / double(region_.area());
}

// The largest scale whose mean count is not above the one asked for.
void NeymanAllocation::solve() {
  for (int h = 0; h < kHalves; ++h) {
    int low = -2 * kBins, high = 2 * kBins;  // mean_count(low) is `least`
    while (high - low > 1) {
      const int middle = low + (high - low) / 2;
      (mean_count(h, middle) <= request_.mean ? low : high) = middle;
    }
    shift_[h] = low;
  }
}

void NeymanAllocation::assign(std::size_t part) {
  SampleTargets& targets = *film_.targets();
  const PixelRect& w = windows_[part];
  for (int h = 0; h < kHalves; ++h) {
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) {
        targets.target(h, x, y) = count_of(bin_of(targets.demand(h, x, y)), shift_[h], least_, most_);
      }
    }
  }
  note_targets(part);
}

}  // namespace helio
