// Sample counts from the other half's pilot: see sample_allocation.h.
//
// demand() holds, per half, log2 of s / sqrt(c); to the power g, times a dither of [1, 2) that is the pixel's own,
// times a scale, rounded down to a power of two, it is the count. The scale sets the mean; it is found in a histogram,
// so that later rounds need one sweep only. Where somebody looks, the density is one more factor, and the histogram is
// of the gaze: each round makes its own.
#pragma once

#include "renderer/film/allocation/demand_allocation.h"

namespace helio {

class NeymanAllocation final : public DemandAllocation {
 public:
  // Of SampleTargets::histogram, once the demand is known.
  static constexpr std::size_t kHistogramBins = 96 * 128;

  NeymanAllocation(Film& film, const PixelRect& region, const AllocationSettings& settings,
                   const AllocationRequest& request);

  void run(int sweep, std::size_t part) override;
  void finish_sweep(int sweep) override;

 private:
  enum class Sweep { means, demand, histogram, solve, assign };
  static constexpr int kExponents = 5;
  // Of one half's pixels: own variance over the count, and cost times the count, if counts were demand to the power
  // i / (kExponents - 1).
  struct Outlook {
    double variance[kExponents] = {}, cost[kExponents] = {};
  };
  static int sweeps_of(const Film& film, const AllocationSettings& settings);
  Sweep kind(int sweep) const;
  // Counts are one number.
  bool uniform(const SampleTargets& targets) const;
  void find_demand(std::size_t part);
  void find_demand_of(int h, const PixelRect& window, Outlook& outlook);
  void choose_exponent();
  void count_pixels(std::size_t part);
  float value(const SampleTargets& targets, int h, int x, int y) const;
  void assign(std::size_t part);
  void solve(int h);
  double mean_count(int h, int shift) const;

  std::vector<Outlook> part_outlooks_[kHalves];
  std::uint32_t least_ = 1, most_ = 1;
  int shift_[kHalves] = {0, 0};  // the scale, in bins of the histogram
};

}  // namespace helio
