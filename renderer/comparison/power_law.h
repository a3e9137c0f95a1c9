// Curves of error against time are nearly straight in logarithms.
#pragma once

#include <cmath>

namespace helio {

// The logarithm of y at x, on the straight line in logarithms through two points, between and beyond them.
// Precondition: all are positive, x0 != x1.
inline double log_on_power_law(double x0, double y0, double x1, double y1, double x) {
  const double slope = (std::log(y1) - std::log(y0)) / (std::log(x1) - std::log(x0));
  return std::log(y1) + slope * (std::log(x) - std::log(x1));
}

}  // namespace helio
