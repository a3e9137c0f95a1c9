// Base of the two allocations by demand (film/allocation/sample_demand.h).
#pragma once

#include <vector>

#include "renderer/film/allocation/sample_allocation.h"

namespace helio {

class DemandAllocation : public SampleAllocation {
 protected:
  DemandAllocation(Film& film, const PixelRect& region, int sweeps, const AllocationSettings& settings,
                   const AllocationRequest& request);

  // Every pixel gets this share of the mean: what a pilot or history has missed is found, if late. It costs at most as
  // much.
  static constexpr double kLeastShare = 1.0 / 8;
  // The same where somebody looks elsewhere.
  static constexpr double kLeastUnseenShare = GazeDensity::kLeastDensity;
  // And no more than this many times the mean, lest a pilot's single bright sample take the round.
  static constexpr double kMostShare = 64;

  double least_share() const { return settings_.density ? kLeastUnseenShare : kLeastShare; }
  // log2 of what the gaze has the pixel's count multiplied by.
  float log_density(int x, int y) const {
    return settings_.density ? settings_.density->log_at(float(x) + 0.5f, float(y) + 0.5f) : 0.0f;
  }

  // A sweep that finds epsilon_.
  void add_means(std::size_t part);
  void finish_means();

  AllocationSettings settings_;
  AllocationRequest request_;
  double epsilon_[kHalves] = {0, 0};  // find_demand()'s, of the half that is looked at

 private:
  std::vector<double> part_sums_[kHalves];
};

}  // namespace helio
