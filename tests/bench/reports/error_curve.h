// Error against time of one run, measured at a few sample counts.
#pragma once

#include <optional>
#include <vector>

namespace helio::bench {

struct CurvePoint {
  int samples = 0;  // per pixel
  double seconds = 0;
  double error = 0;
};

// Where the curve first falls to the target: between the two measured points around it, along the straight line in
// log(error) over log(seconds). Nothing when no two points enclose the target: that would be an extrapolation.
std::optional<double> time_to(const std::vector<CurvePoint>& curve, double target);

}  // namespace helio::bench
