// Error against time, measured at a few sample counts.
#pragma once

#include <cmath>
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
inline std::optional<double> time_to(const std::vector<CurvePoint>& curve, double target) {
  for (std::size_t i = 1; i < curve.size(); ++i) {
    const CurvePoint &a = curve[i - 1], &b = curve[i];
    if (a.error <= target || b.error > target) continue;
    const double t = std::log(a.error / target) / std::log(a.error / b.error);
    return a.seconds * std::pow(b.seconds / a.seconds, t);
  }
  return std::nullopt;
}

}  // namespace helio::bench
