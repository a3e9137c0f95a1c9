#include "renderer/metrics/flip_kernels.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace helio {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFeatureWidth = 0.082;  // degrees
constexpr double kCutOff = 1e-9;         // of the largest tap: far below what a float map resolves

using Taps = std::vector<double>;  // at 0, 1, ..., radius

// Of the whole even filter.
double sum_of(const Taps& taps) {
  double sum = taps[0];
  for (std::size_t i = 1; i < taps.size(); ++i) sum += 2 * taps[i];
  return sum;
}

HalfKernel rounded(const Taps& taps, double factor) {
  double largest = 0;
  for (const double tap : taps) largest = std::max(largest, std::abs(tap));
  HalfKernel kernel;
  for (const double tap : taps) kernel.push_back(float(tap * factor));
  while (kernel.size() > 1 && std::abs(taps[kernel.size() - 1]) < kCutOff * largest) kernel.pop_back();
  return kernel;
}

// exp(-pi^2 x^2 / b), x in degrees: a Gaussian of the contrast sensitivity without its amplitude.
Taps contrast_gaussian(double b, int radius, double pixels_per_degree) {
  Taps taps;
  for (int i = 0; i <= radius; ++i) {
    const double x = i / pixels_per_degree;
    taps.push_back(std::exp(-kPi * kPi * x * x / b));
  }
  return taps;
}

int contrast_radius(double pixels_per_degree) {
  constexpr double kLargestB = 0.04;
  return int(std::ceil(3 * std::sqrt(kLargestB / (2 * kPi * kPi)) * pixels_per_degree));
}

}  // namespace

FlipKernels::FlipKernels(double pixels_per_degree) {
  const int contrast = contrast_radius(pixels_per_degree);
  const Taps a = contrast_gaussian(0.0047, contrast, pixels_per_degree);
  achromatic = rounded(a, 1 / sum_of(a));
  const Taps rg = contrast_gaussian(0.0053, contrast, pixels_per_degree);
  red_green = rounded(rg, 1 / sum_of(rg));

  // a_i sqrt(pi / b_i) exp(-pi^2 (x^2 + y^2) / b_i), summed over i and divided by the sum of all taps.
  constexpr double kAmplitude[2] = {34.1, 13.5}, kB[2] = {0.04, 0.025};
  Taps by[2];
  double weight[2];
  for (int i = 0; i < 2; ++i) {
    by[i] = contrast_gaussian(kB[i], contrast, pixels_per_degree);
    weight[i] = kAmplitude[i] * std::sqrt(kPi / kB[i]) * sum_of(by[i]) * sum_of(by[i]);
  }
  for (int i = 0; i < 2; ++i) {
    blue_yellow[i].horizontal = rounded(by[i], 1 / sum_of(by[i]));
    blue_yellow[i].vertical = rounded(by[i], weight[i] / (weight[0] + weight[1]) / sum_of(by[i]));
  }

  const double deviation = 0.5 * kFeatureWidth * pixels_per_degree;
  const int feature = int(std::ceil(3 * deviation));
  Taps g, d, dd;
  double slope = 0, positive = 0, negative = 0;
  for (int i = 0; i <= feature; ++i) {
    const double x = i / deviation;
    g.push_back(std::exp(-0.5 * x * x));
    d.push_back(i * g.back());
    slope += d.back();
    dd.push_back((x * x - 1) * g.back());
    (dd.back() > 0 ? positive : negative) += (i == 0 ? 1 : 2) * std::abs(dd.back());
  }
  for (double& tap : dd) tap /= tap > 0 ? positive : negative;
  gaussian = rounded(g, 1 / sum_of(g));
  first = rounded(d, 1 / slope);
  second = rounded(dd, 1);
  radius = std::max(contrast, feature);
}

}  // namespace helio
