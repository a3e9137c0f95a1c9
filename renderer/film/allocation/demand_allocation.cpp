#include "renderer/film/allocation/demand_allocation.h"

#include "renderer/film/allocation/sample_demand.h"
#include "renderer/film/estimate/error_estimate.h"

namespace helio {

DemandAllocation::DemandAllocation(Film& film, const PixelRect& region, int sweeps, const AllocationSettings& settings,
                                   const AllocationRequest& request)
    : SampleAllocation(film, region, sweeps), settings_(settings), request_(request) {
  for (std::vector<double>& sums : part_sums_) sums.resize(parts());
}

void DemandAllocation::add_means(std::size_t part) {
  for (int h = 0; h < kHalves; ++h) part_sums_[h][part] = sum_of_means(film_, windows_[part], h);
}

void DemandAllocation::finish_means() {
  for (int h = 0; h < kHalves; ++h) {
    double sum = 0;
    for (const double part : part_sums_[h]) sum += part;
    const double mean = sum / (3.0 * double(region_.area()));
    epsilon_[h] = settings_.measure == AllocationMeasure::relative ? kRelativeEpsilon * mean * mean : 1;
  }
}

}  // namespace helio
