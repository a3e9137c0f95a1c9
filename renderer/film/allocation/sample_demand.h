// How much each pixel of a half wants samples, from what the other half has seen: s^2 / c, s: deviation of a sample in
// the measure of the picture's error, c: its cost in rays. Splats are part of what relative errors are relative to, not
// of the deviation: a pixel's own samples do not make their noise smaller. (Carried samples have them in both: what is
// asked for there is too much, at worst by what the splats' noise is of the whole.)
#pragma once

#include <functional>

#include "renderer/film/allocation/sample_allocation.h"

namespace helio {

struct PixelDemand {
  bool known = false;      // some pixel of the 7x7 neighbourhood has two samples in the other half
  // s^2, s: mean of the neighbourhood's deviations in the other half, each over what that pixel's error is relative to.
  // Over what the mean of all is relative to, what is dark beside a lamp would get nothing.
  double squared = 0;
  double own_squared = 0;  // of the pixel's own half, over the other's mean
  double cost = 1;         // rays a path, >= 1
};

// log2 of s / sqrt(c), in [-45, 45].
double log_demand(const PixelDemand& demand);

// The largest power of two that is not above x, in [1, 2^30].
std::uint32_t power_of_two_below(double x);

enum class DemandPixels {
  all,
  fresh,  // a neighbourhood is those of its pixels that carry nothing
};

// epsilon: what is added to the squared mean under a relative error. Calls visit for every pixel of the window, row by
// row; pixels outside the region are not read.
void find_demand(const Film& film, const PixelRect& region, const PixelRect& window, int half,
                 AllocationMeasure measure, double epsilon, DemandPixels pixels,
                 const std::function<void(int x, int y, const PixelDemand& demand)>& visit);

// Sum over a window's pixels of one half's means, all channels.
double sum_of_means(const Film& film, const PixelRect& window, int half);

}  // namespace helio
