// The z-tests by which a rendering is compared with a reference: per pixel and per tile of 16 x 16.
//
// Two independent estimates a and b of the same number with known variances of their means differ by
// z = (a - b) / sqrt(var a + var b), a standard normal when both are unbiased. Every channel of every pixel is one test
// at a level corrected for their number (Sidak 1967: 1 - (1 - alpha)^(1 / n)); alpha = 0.01.
#pragma once

#include <string>
#include <vector>

#include "renderer/base/math.h"

namespace helio::test {

struct Estimate {
  int width = 0, height = 0;
  std::vector<V3d> mean, variance;  // by row; variance of the mean
  // Of a sum of neighbouring pixels the variance over the sum of their variances: 1 where pixels are independent, more
  // where a sample counts in several.
  double overlap = 1;
};

inline constexpr double kAlpha = 0.01;
inline constexpr double kLeastShare = 0.9975;  // of pixel channels inside their bound
inline constexpr int kTileSide = 16;
// Standard deviations below this share of the reference count as that: a variance that was estimated from few samples
// may have missed what is rare, and both renderers round.
inline constexpr double kRelativeFloor = 1e-3;

struct ZTestResult {
  double pixels_inside = 0;  // share
  double worst_tile = 0;     // largest |z| of a tile over its bound: at most 1 passes
  int worst_x = 0, worst_y = 0, worst_channel = 0;
  bool passed() const { return pixels_inside >= kLeastShare && worst_tile <= 1; }
  std::string to_string() const;
};

// Two-sided bound on |z| of one among `tests` independent tests that together err with probability alpha.
double sidak_bound(double alpha, double tests);

// Both of one size, a multiple of nothing: tiles at the right and lower edge are cut.
ZTestResult z_test(const Estimate& rendering, const Estimate& reference);

}  // namespace helio::test
