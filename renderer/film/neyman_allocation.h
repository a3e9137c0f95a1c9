// Sample counts from the other half's pilot: see sample_allocation.h.
//
// demand() holds, per half, log2 of s / sqrt(c) plus a dither in [0, 1) that is the pixel's own; a count is then
// 2^floor(demand + scale), and one number, the scale, sets the mean. It is found in a histogram of the demand, so that
// later rounds need one sweep only.
#pragma once

#include "renderer/film/sample_allocation.h"

namespace helio {

class NeymanAllocation final : public SampleAllocation {
 public:
  NeymanAllocation(Film& film, const PixelRect& region, const AllocationSettings& settings,
                   const AllocationRequest& request);

  void run(int sweep, std::size_t part) override;
  void finish_sweep(int sweep) override;

 private:
  enum class Sweep { means, demand, assign };
  Sweep kind(int sweep) const;
  void add_means(std::size_t part);
  void find_demand(std::size_t part);
  void find_demand_of(int h, const PixelRect& window);
  void assign(std::size_t part);
  void solve();
  double mean_count(int h, int shift) const;

  AllocationSettings settings_;
  AllocationRequest request_;
  std::vector<double> part_sums_[kHalves];
  double epsilon_[kHalves] = {0, 0};  // of the half that is looked at
  std::uint32_t least_ = 1, most_ = 1;
  int shift_[kHalves] = {0, 0};  // the scale, in bins of the histogram
};

}  // namespace helio
