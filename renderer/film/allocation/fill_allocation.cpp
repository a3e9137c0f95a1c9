#include "renderer/film/allocation/fill_allocation.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "renderer/base/check.h"
#include "renderer/film/allocation/sample_demand.h"
#include "renderer/film/core/pixel_hash.h"
#include "renderer/film/core/sample_targets.h"
#include "renderer/film/history/film_history.h"

namespace helio {
namespace {

// Pixels that the solution looks at, at most, and at least half as many where there are more: their mean count is the
// picture's to about one percent.
constexpr std::int64_t kLookedAt = 1 << 14;

// Samples of each half that pixels which carry nothing get at first, as far as others do; then what fresh samples have
// seen takes the place of what history alone did, and what they cost is known.
constexpr double kPilot = 4;

// Of the mean count: samples that pixels which carry something get at least as long as that is less than one, so that
// wrong history is seen to be wrong. Later DemandAllocation::kLeastShare is more.
constexpr double kCheckedShare = 0.5 / kHalfCheckedMean;

// Written as the demand of a pixel of which nothing is known; finish_sweep() knows the others' mean.
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

}  // namespace

FillAllocation::FillAllocation(Film& film, const PixelRect& region, const AllocationSettings& settings,
                               const AllocationRequest& request)
    : DemandAllocation(film, region, 1, settings, request),
      first_(!film.targets()->demand_known),
      fresh_(!first_ && !film.targets()->fresh_demand_known && film.targets()->fresh_least >= kPilot) {
  HELIO_DCHECK(film.history());
  if (first_) {
    film.targets()->fresh_demand_known = false;
    film.targets()->fresh_least = 0;  // the last picture's, until this one's counts are solved for
  }
  sweeps_ = first_ || fresh_ ? 4 : 2;
  for (std::vector<Known>& known : part_known_) known.resize(parts());
  most_ = power_of_two_below(request.mean * kMostShare);
  for (std::uint32_t& least : fresh_least_)
    least = power_of_two_below(std::max(request.mean * least_share(), std::min(request.mean, kPilot)));
}

FillAllocation::Sweep FillAllocation::kind(int sweep) const {
  constexpr Sweep kAll[] = {Sweep::means, Sweep::demand, Sweep::steps, Sweep::assign};
  return kAll[int(std::size(kAll)) - sweeps_ + sweep];
}

void FillAllocation::run(int sweep, std::size_t part) {
  switch (kind(sweep)) {
    case Sweep::means:
      return add_means(part);
    case Sweep::demand:
      find_demand(part);
      if (fresh_) find_fresh_demand(part);
      return;
    case Sweep::steps:
      return find_steps(part);
    case Sweep::assign:
      return assign(part);
  }
}

void FillAllocation::finish_sweep(int sweep) {
  switch (kind(sweep)) {
    case Sweep::means:
      return finish_means();
    case Sweep::demand:
      for (int h = 0; h < kHalves; ++h) {
        Known total;
        for (const Known& part : part_known_[h]) {
          total.sum += part.sum;
          total.pixels += part.pixels;
        }
        film_.targets()->usual_demand[h] = total.pixels > 0 ? float(total.sum / double(total.pixels)) : 0.0f;
      }
      film_.targets()->demand_known = true;
      film_.targets()->fresh_demand_known = fresh_;
      return;
    case Sweep::steps:
      return solve();
    case Sweep::assign:
      return finish_round();
  }
}

void FillAllocation::find_demand(std::size_t part) {
  SampleTargets& targets = *film_.targets();
  for (int h = 0; h < kHalves; ++h) {
    Known& known = part_known_[h][part];
    known = {};
    helio::find_demand(film_, region_, windows_[part], h, settings_.measure, epsilon_[1 - h], DemandPixels::all,
                       [&](int x, int y, PixelDemand pixel) {
                         pixel.cost = 1;  // the first samples are of half A alone, and of some blocks
                         const bool usable = settings_.by_noise && pixel.known && pixel.squared > 0;
                         targets.set_demand(h, x, y, usable ? float(log_demand(pixel)) : kUnknown);
                         if (!usable) return;
                         known.sum += double(targets.demand(h, x, y));
                         ++known.pixels;
                       });
  }
}

// Where nothing was carried, what fresh samples of the other half say takes the place of what the surroundings did.
void FillAllocation::find_fresh_demand(std::size_t part) {
  SampleTargets& targets = *film_.targets();
  for (int h = 0; h < kHalves; ++h) {
    helio::find_demand(film_, region_, windows_[part], h, settings_.measure, epsilon_[1 - h], DemandPixels::fresh,
                       [&](int x, int y, const PixelDemand& pixel) {
                         if (!settings_.by_noise || film_.history()->carried(x, y).count[h] > 0 || !pixel.known ||
                             !(pixel.squared > 0))
                           return;
                         targets.set_demand(h, x, y, float(log_demand(pixel)));
                       });
  }
}

FillAllocation::Pixel FillAllocation::pixel(int h, int x, int y) const {
  const SampleTargets& targets = *film_.targets();
  const float demand = targets.demand(h, x, y);
  return {std::exp2((std::isnan(demand) ? targets.usual_demand[h] : demand) + log_density(x, y)),
          float(film_.history()->carried(x, y).count[h]), film_.attempted(h, x, y), dither(x, y, settings_.seed)};
}

// Whatever the level.
std::uint32_t FillAllocation::least_of(const Pixel& pixel, std::uint32_t fresh_least) const {
  if (pixel.carried == 0) return std::max(fresh_least, pixel.has);
  const double checks = request_.mean * kCheckedShare;
  const std::uint32_t least =
      checks >= 1 ? power_of_two_below(request_.mean * least_share()) : std::uint32_t(checks > double(pixel.chance));
  return std::max(least, pixel.has);
}

// Fresh samples that bring the pixel to its share of `level`, a power of two; between 0 and 1 and between two powers
// chance decides.
std::uint32_t FillAllocation::count_of(int h, const Pixel& pixel, double level) const {
  const double missing = level * double(pixel.demand) - double(pixel.carried);
  std::uint32_t count = 0;
  if (missing >= 1) {
    count = std::bit_floor(std::uint32_t(std::min(missing * (1 + double(pixel.chance)), double(most_))));
  } else if (missing > double(pixel.chance)) {
    count = 1;
  }
  return std::max(count, least_of(pixel, fresh_least_[h]));
}

// The levels at which count_of() rises.
void FillAllocation::add_steps(const Pixel& pixel, std::uint32_t fresh_least, LevelSteps& steps) const {
  std::uint32_t has = least_of(pixel, fresh_least);
  steps.add_least(has);
  const float scale = 1 / pixel.demand, octave = 1 / (1 + pixel.chance);
  for (std::uint32_t count = std::bit_floor(has) * 2 + (has == 0); count <= most_ && count > 0; count *= 2) {
    const float missing = count > 1 ? float(count) * octave : pixel.chance;
    steps.add((pixel.carried + missing) * scale, count - has);
    has = count;
  }
}

void FillAllocation::find_steps(std::size_t part) {
  const PixelRect& w = windows_[part];
  const std::int64_t width = region_.width(), every = (region_.area() + kLookedAt - 1) / kLookedAt;
  Steps found;
  for (int y = w.y0; y < w.y1; ++y) {
    const std::int64_t row =
        std::int64_t(y - region_.y0) * width - region_.x0;  // number of a pixel of the region, less x
    const std::int64_t begin = row + w.x0, end = row + w.x1;
    for (std::int64_t group = begin / every; group * every < end; ++group) {
      // One of each group.
      const std::int64_t i =
          group * every + (every > 1 ? std::int64_t(hash64(std::uint64_t(group)) % std::uint64_t(every)) : 0);
      if (i < begin || i >= end) continue;
      const int x = int(i - row);
      const Pixel first = pixel(0, x, y), second = pixel(1, x, y);
      add_steps(first, fresh_least_[0], found.levels[0]);
      add_steps(second, fresh_least_[1], found.levels[1]);
      if (request_.mean < 1) add_steps(second, 0, found.levels[2]);
      ++found.pixels;
    }
  }
  const std::lock_guard lock(steps_mutex_);
  for (int k = 0; k < kSolutions; ++k) steps_.levels[k].add(found.levels[k]);
  steps_.pixels += found.pixels;
}

// What the least counts bring one half above its share the other goes without.
void FillAllocation::solve() {
  const double share = request_.mean * double(steps_.pixels);
  const LevelSteps::Affordable first = steps_.levels[0].highest(share);
  const double rest = std::max(0.0, 2 * share - std::max(double(first.samples), share));
  const LevelSteps* second = &steps_.levels[1];
  // One half is enough to show something.
  if (request_.mean < 1 && double(second->least()) > rest) {
    fresh_least_[1] = 0;
    second = &steps_.levels[2];
  }
  level_[0] = first.level;
  level_[1] = second->highest(rest).level;
  film_.targets()->fresh_least = fresh_least_[1];
}

void FillAllocation::assign(std::size_t part) {
  SampleTargets& targets = *film_.targets();
  const PixelRect& w = windows_[part];
  for (int h = 0; h < kHalves; ++h) {
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) targets.set_target(h, x, y, count_of(h, pixel(h, x, y), level_[h]));
    }
  }
  note_targets(part);
}

}  // namespace helio
