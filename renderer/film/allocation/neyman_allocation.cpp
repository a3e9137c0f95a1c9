#include "renderer/film/allocation/neyman_allocation.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

#include "renderer/film/allocation/sample_demand.h"
#include "renderer/film/core/pixel_hash.h"
#include "renderer/film/core/sample_targets.h"

namespace helio {
namespace {

// Bins of the histogram: 1/128 of an octave over 96 octaves; what is outside counts as the outermost.
constexpr int kBinsPerOctave = 128;
constexpr int kOctaves = 96;
constexpr int kBins = kOctaves * kBinsPerOctave;
static_assert(kBins == NeymanAllocation::kHistogramBins);
constexpr float kLowest = -float(kOctaves) / 2;

int bin_of(float value) {
  return std::clamp(int(std::floor((value - kLowest) * kBinsPerOctave)), 0, kBins - 1);
}

// Counts differ only where that promises at least this gain: a smaller one may be chance.
constexpr double kLeastGain = 1.03;

// The count that a bin shifted by the scale stands for, between `least` and `most`, both powers of two.
std::uint32_t count_of(int bin, int shift, std::uint32_t least, std::uint32_t most) {
  const int octave = (bin + shift) >= 0 ? (bin + shift) / kBinsPerOctave : -1;
  if (octave < 0 || octave >= 32) return octave < 0 ? least : most;
  return std::clamp(std::uint32_t(1) << octave, least, most);
}

}  // namespace

NeymanAllocation::NeymanAllocation(Film& film, const PixelRect& region, const AllocationSettings& settings,
                                   const AllocationRequest& request)
    : DemandAllocation(film, region, sweeps_of(film, settings), settings, request) {
  for (std::vector<Outlook>& outlooks : part_outlooks_) outlooks.resize(parts());
  const std::uint32_t pilot = settings.min_samples / 2;
  least_ = std::max(std::max(pilot, 1u), power_of_two_below(request.mean * least_share()));
  most_ = std::max(least_, power_of_two_below(request.mean * kMostShare));
  if (kind(0) == Sweep::solve) return;
  for (std::vector<std::uint32_t>& histogram : film.targets()->histogram) histogram.assign(kBins, 0);
}

int NeymanAllocation::sweeps_of(const Film& film, const AllocationSettings& settings) {
  if (settings.by_noise && !film.targets()->demand_known) return 5;
  return settings.density || !film.targets()->demand_known ? 3 : 2;
}

bool NeymanAllocation::uniform(const SampleTargets& targets) const {
  return !settings_.density && (!settings_.by_noise || targets.exponent == 0);
}

NeymanAllocation::Sweep NeymanAllocation::kind(int sweep) const {
  return Sweep(int(Sweep::assign) + 1 - sweeps_ + sweep);
}

void NeymanAllocation::run(int sweep, std::size_t part) {
  switch (kind(sweep)) {
    case Sweep::means:
      return add_means(part);
    case Sweep::demand:
      return find_demand(part);
    case Sweep::histogram:
      return count_pixels(part);
    case Sweep::solve:
      for (int h = int(part); h < kHalves; h += int(parts())) solve(h);
      return;
    case Sweep::assign:
      return assign(part);
  }
}

void NeymanAllocation::finish_sweep(int sweep) {
  switch (kind(sweep)) {
    case Sweep::means:
      return finish_means();
    case Sweep::demand:
      choose_exponent();
      return;
    case Sweep::histogram:
      film_.targets()->demand_known = true;
      return;
    case Sweep::solve:
      film_.targets()->uniform = std::uint32_t(std::max(request_.mean, 1.0));
      return;
    case Sweep::assign:
      finish_round();
      return;
  }
}

void NeymanAllocation::find_demand(std::size_t part) {
  for (int h = 0; h < kHalves; ++h) find_demand_of(h, windows_[part], part_outlooks_[h][part]);
}

// Of half h, from what the other one has seen.
void NeymanAllocation::find_demand_of(int h, const PixelRect& window, Outlook& outlook) {
  SampleTargets& targets = *film_.targets();
  helio::find_demand(film_, region_, window, h, settings_.measure, epsilon_[1 - h], DemandPixels::all,
                     [&](int x, int y, const PixelDemand& pixel) {
                       const double demand = log_demand(pixel);
                       targets.set_demand(h, x, y, float(demand));
                       const double step = std::exp2(demand / (kExponents - 1));
                       double count = 1;
                       for (int g = 0; g < kExponents; ++g, count *= step) {
                         outlook.variance[g] += pixel.own_squared / count;
                         outlook.cost[g] += pixel.cost * count;
                       }
                     });
}

void NeymanAllocation::choose_exponent() {
  double gain[kExponents] = {};  // over uniform counts, mean of the halves'
  for (int h = 0; h < kHalves; ++h) {
    Outlook total;
    for (const Outlook& part : part_outlooks_[h]) {
      for (int g = 0; g < kExponents; ++g) {
        total.variance[g] += part.variance[g];
        total.cost[g] += part.cost[g];
      }
    }
    const double uniform = total.variance[0] * total.cost[0];
    for (int g = 0; g < kExponents; ++g) {
      const double at = total.variance[g] * total.cost[g];
      gain[g] += at > 0 ? uniform / at / kHalves : 0;
    }
  }
  const int best = int(std::max_element(gain, gain + kExponents) - gain);
  film_.targets()->exponent = gain[best] >= kLeastGain ? float(best) / (kExponents - 1) : 0.0f;
}

float NeymanAllocation::value(const SampleTargets& targets, int h, int x, int y) const {
  const float noise = settings_.by_noise ? targets.exponent * targets.demand(h, x, y) : 0.0f;
  return noise + log_density(x, y) + dither(x, y, settings_.seed);
}

void NeymanAllocation::count_pixels(std::size_t part) {
  SampleTargets& targets = *film_.targets();
  const PixelRect& w = windows_[part];
  for (int h = 0; h < kHalves; ++h) {
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) {
        std::uint32_t& pixels = targets.histogram[h][std::size_t(bin_of(value(targets, h, x, y)))];
        std::atomic_ref(pixels).fetch_add(1, std::memory_order_relaxed);
      }
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
void NeymanAllocation::solve(int h) {
  int low = -2 * kBins, high = 2 * kBins;  // mean_count(low) is `least`
  while (high - low > 1) {
    const int middle = low + (high - low) / 2;
    (mean_count(h, middle) <= request_.mean ? low : high) = middle;
  }
  shift_[h] = low;
}

void NeymanAllocation::assign(std::size_t part) {
  SampleTargets& targets = *film_.targets();
  const PixelRect& w = windows_[part];
  for (int h = 0; h < kHalves; ++h) {
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) {
        if (uniform(targets)) {
          targets.set_uniform(h, x, y);  // a power of two would do less well
        } else {
          targets.set_target(h, x, y, count_of(bin_of(value(targets, h, x, y)), shift_[h], least_, most_));
        }
      }
    }
  }
  note_targets(part);
}

}  // namespace helio
