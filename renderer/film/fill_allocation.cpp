#include "renderer/film/fill_allocation.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

#include "renderer/film/film_history.h"
#include "renderer/film/pixel_hash.h"
#include "renderer/film/sample_demand.h"
#include "renderer/film/sample_targets.h"

namespace helio {
namespace {

// Pixels that the solution looks at: their mean count is the picture's to about one percent.
constexpr std::int64_t kLookedAt = 1 << 15;

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
  assert(film.history());
  if (first_) film.targets()->fresh_demand_known = false;
  sweeps_ = first_ || fresh_ ? 3 : 1;
  for (std::vector<Known>& known : part_known_) known.resize(parts());
  most_ = power_of_two_below(request.mean * kMostShare);
  for (std::uint32_t& least : fresh_least_)
    least = power_of_two_below(std::max(request.mean * kLeastShare, std::min(request.mean, kPilot)));
  if (sweeps_ == 1) solve();
}

FillAllocation::Sweep FillAllocation::kind(int sweep) const {
  if (sweep + 1 == sweeps_) return Sweep::assign;
  return sweep == 0 ? Sweep::means : Sweep::demand;
}

void FillAllocation::run(int sweep, std::size_t part) {
  switch (kind(sweep)) {
    case Sweep::means:
      return add_means(part);
    case Sweep::demand:
      find_demand(part);
      if (fresh_) find_fresh_demand(part);
      return;
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
      solve();
      film_.targets()->demand_known = true;
      film_.targets()->fresh_demand_known = fresh_;
      return;
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
                       [&](int x, int y, const PixelDemand& pixel) {
                         const bool usable = pixel.known && pixel.squared > 0;
                         targets.demand(h, x, y) = usable ? float(log_demand(pixel)) : kUnknown;
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
                         if (film_.history()->carried(x, y).count[h] > 0 || !pixel.known || !(pixel.squared > 0))
                           return;
                         targets.demand(h, x, y) = float(log_demand(pixel));
                       });
  }
}

FillAllocation::Pixel FillAllocation::pixel(int h, int x, int y) const {
  const SampleTargets& targets = *film_.targets();
  const float demand = targets.demand(h, x, y);
  return {std::exp2(double(std::isnan(demand) ? targets.usual_demand[h] : demand)),
          double(film_.history()->carried(x, y).count[h]), film_.attempted(h, x, y), dither(x, y, settings_.seed)};
}

// Fresh samples that bring the pixel to its share of `level`, a power of two; between 0 and 1 and between two powers
// chance decides.
std::uint32_t FillAllocation::count_of(int h, const Pixel& pixel, double level) const {
  const double missing = level * pixel.demand - pixel.carried;
  std::uint32_t count = 0;
  if (missing >= 1) {
    count = std::bit_floor(std::uint32_t(std::min(missing * (1 + double(pixel.chance)), double(most_))));
  } else if (missing > double(pixel.chance)) {
    count = 1;
  }
  const double checks = request_.mean * kCheckedShare;
  std::uint32_t least = fresh_least_[h];
  if (pixel.carried > 0)
    least =
        checks >= 1 ? power_of_two_below(request_.mean * kLeastShare) : std::uint32_t(checks > double(pixel.chance));
  return std::max(std::clamp(count, least, std::max(least, most_)), pixel.has);
}

// What the least counts bring one half above its share the other goes without.
void FillAllocation::solve() {
  const double looks = double(std::min(region_.area(), kLookedAt)), share = request_.mean * looks;
  const double used = solve(0, share);
  solve(1, std::max(0.0, 2 * share - std::max(used, share)));
  film_.targets()->fresh_least = fresh_least_[1];
}

// The largest level under which the pixels that are looked at get no more samples than allowed, or those that they get
// at least. Returns how many that is.
double FillAllocation::solve(int h, double allowed) {
  const std::int64_t area = region_.area(), looks = std::min(area, kLookedAt);
  std::vector<Pixel> pixels;
  for (std::int64_t k = 0; k < looks; ++k) {
    // All of a small region; of a larger one, places as even as multiples of the golden ratio are.
    const double part = double(std::uint64_t(k) * 0x9e3779b97f4a7c15u >> 11) * 0x1p-53;
    const std::int64_t i = looks == area ? k : std::int64_t(part * double(area));
    pixels.push_back(pixel(h, region_.x0 + int(i % region_.width()), region_.y0 + int(i / region_.width())));
  }
  const auto samples = [&](double level) {
    double sum = 0;
    for (const Pixel& pixel : pixels) sum += count_of(h, pixel, level);
    return sum;
  };
  // One half is enough to show something.
  if (h > 0 && request_.mean < 1 && samples(0) > allowed) fresh_least_[h] = 0;
  double low = -100, high = 100;  // log2 of the level
  for (int step = 0; step < 16; ++step) {
    const double middle = 0.5 * (low + high);
    (samples(std::exp2(middle)) <= allowed ? low : high) = middle;
  }
  level_[h] = std::exp2(low);
  return samples(level_[h]);
}

void FillAllocation::assign(std::size_t part) {
  SampleTargets& targets = *film_.targets();
  const PixelRect& w = windows_[part];
  for (int h = 0; h < kHalves; ++h) {
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) targets.target(h, x, y) = count_of(h, pixel(h, x, y), level_[h]);
    }
  }
  note_targets(part);
}

}  // namespace helio
