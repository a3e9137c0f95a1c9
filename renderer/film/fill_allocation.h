// Counts where pixels hold samples of earlier pictures already; see sample_allocation.h.
#pragma once

#include <cstddef>
#include <vector>

#include "renderer/film/demand_allocation.h"

namespace helio {

// Precondition: the film has history.
class FillAllocation final : public DemandAllocation {
 public:
  FillAllocation(Film& film, const PixelRect& region, const AllocationSettings& settings,
                 const AllocationRequest& request);

  void run(int sweep, std::size_t part) override;
  void finish_sweep(int sweep) override;

 private:
  enum class Sweep { means, demand, fresh_demand, assign };
  Sweep kind(int sweep) const;

  struct Known {
    double sum = 0;  // of log2 demand
    std::size_t pixels = 0;
  };
  struct Pixel {
    double demand = 1;
    double carried = 0;     // samples
    std::uint32_t has = 0;  // fresh ones
    float chance = 0;    // in [0, 1)
  };

  void find_demand(std::size_t part);
  void find_fresh_demand(std::size_t part);
  void assign(std::size_t part);
  void solve(int h);
  Pixel pixel(int h, int x, int y) const;
  std::uint32_t count_of(const Pixel& pixel, double level) const;

  bool first_, fresh_;  // the first round | the one that looks at pixels that carry nothing
  std::uint32_t least_ = 0, most_ = 1, fresh_least_ = 1;
  double level_[kHalves] = {0, 0};  // effective samples of a pixel whose demand is 1
  std::vector<Known> part_known_[kHalves];
};

}  // namespace helio
