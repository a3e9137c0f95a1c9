// Counts where pixels hold samples of earlier pictures already; see sample_allocation.h.
#pragma once

#include <cstddef>
#include <mutex>
#include <vector>

#include "renderer/film/allocation/demand_allocation.h"
#include "renderer/film/core/level_steps.h"

namespace helio {

// Precondition: the film has history.
class FillAllocation final : public DemandAllocation {
 public:
  FillAllocation(Film& film, const PixelRect& region, const AllocationSettings& settings,
                 const AllocationRequest& request);

  void run(int sweep, std::size_t part) override;
  void finish_sweep(int sweep) override;

 private:
  enum class Sweep { means, demand, steps, assign };
  Sweep kind(int sweep) const;

  struct Known {
    double sum = 0;  // of log2 demand
    std::size_t pixels = 0;
  };
  struct Pixel {
    float demand = 1;
    float carried = 0;      // samples
    std::uint32_t has = 0;  // fresh ones
    float chance = 0;       // in [0, 1)
  };

  void find_demand(std::size_t part);
  void find_fresh_demand(std::size_t part);
  void find_steps(std::size_t part);
  void add_steps(const Pixel& pixel, std::uint32_t fresh_least, LevelSteps& steps) const;
  void solve();
  void assign(std::size_t part);
  Pixel pixel(int h, int x, int y) const;
  std::uint32_t least_of(const Pixel& pixel, std::uint32_t fresh_least) const;
  std::uint32_t count_of(int h, const Pixel& pixel, double level) const;

  bool first_, fresh_;  // the first round | the one that looks at fresh samples
  std::uint32_t most_ = 1, fresh_least_[kHalves] = {1, 1};
  double level_[kHalves] = {0, 0};  // effective samples of a pixel whose demand is 1
  std::vector<Known> part_known_[kHalves];
  // Of the pixels that the solution looks at. The last: of the second half, if pixels that carry nothing need not get
  // anything of it.
  static constexpr int kSolutions = kHalves + 1;
  struct Steps {
    LevelSteps levels[kSolutions];
    std::uint64_t pixels = 0;
  };
  Steps steps_;
  std::mutex steps_mutex_;
};

}  // namespace helio
