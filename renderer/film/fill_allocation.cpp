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

// Pixels that the solution looks at: their mean count is the picture's to half a percent.
constexpr std::int64_t kLookedAt = 1 << 15;

// Samples of each half that pixels which carry nothing get at first, as far as others do; then what they have seen
// themselves takes the place of a guess.
constexpr double kPilot = 4;

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
  least_ = std::bit_floor(std::uint32_t(std::min(request.mean * kLeastShare, double(1u << 30))));
  most_ = power_of_two_below(request.mean * kMostShare);
  fresh_least_ = std::max(least_, power_of_two_below(std::min(request.mean, kPilot)));
  if (sweeps_ == 1) {
    for (int h = 0; h < kHalves; ++h) solve(h);
  }
}

FillAllocation::Sweep FillAllocation::kind(int sweep) const {
  if (sweep + 1 == sweeps_) return Sweep::assign;
  if (sweep == 0) return Sweep::means;
  return first_ ? Sweep::demand : Sweep::fresh_demand;
}

void FillAllocation::run(int sweep, std::size_t part) {
  switch (kind(sweep)) {
    case Sweep::means:
      return add_means(part);
    case Sweep::demand:
      return find_demand(part);
    case Sweep::fresh_demand:
      return find_fresh_demand(part);
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
        solve(h);
      }
      film_.targets()->demand_known = true;
      return;
    case Sweep::fresh_demand:
      for (int h = 0; h < kHalves; ++h) solve(h);
      film_.targets()->fresh_demand_known = true;
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
std::uint32_t FillAllocation::count_of(const Pixel& pixel, double level) const {
  const double missing = level * pixel.demand - pixel.carried;
  std::uint32_t count = 0;
  if (missing >= 1) {
    count = std::bit_floor(std::uint32_t(std::min(missing * (1 + double(pixel.chance)), double(most_))));
  } else if (missing > double(pixel.chance)) {
    count = 1;
  }
  const std::uint32_t least = pixel.carried > 0 ? least_ : fresh_least_;
  return std::max(std::clamp(count, least, std::max(least, most_)), pixel.has);
}

// The largest level whose mean count is not above the one asked for.
void FillAllocation::solve(int h) {
  const std::int64_t area = region_.area(), looks = std::min(area, kLookedAt);
  std::vector<Pixel> pixels;
  for (std::int64_t k = 0; k < looks; ++k) {
    // All of a small region; of a larger one, places as even as multiples of the golden ratio are.
    const double part = double(std::uint64_t(k) * 0x9e3779b97f4a7c15u >> 11) * 0x1p-53;
    const std::int64_t i = looks == area ? k : std::int64_t(part * double(area));
    pixels.push_back(pixel(h, region_.x0 + int(i % region_.width()), region_.y0 + int(i / region_.width())));
  }
  const double allowed = request_.mean * double(pixels.size());
  double low = -100, high = 100;  // log2 of the level
  for (int step = 0; step < 16; ++step) {
    const double middle = 0.5 * (low + high), level = std::exp2(middle);
    double sum = 0;
    for (const Pixel& pixel : pixels) sum += count_of(pixel, level);
    (sum <= allowed ? low : high) = middle;
  }
  level_[h] = std::exp2(low);
  film_.targets()->fresh_least = fresh_least_;
}

void FillAllocation::assign(std::size_t part) {
  SampleTargets& targets = *film_.targets();
  const PixelRect& w = windows_[part];
  for (int h = 0; h < kHalves; ++h) {
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) targets.target(h, x, y) = count_of(pixel(h, x, y), level_[h]);
    }
  }
  note_targets(part);
}

}  // namespace helio
