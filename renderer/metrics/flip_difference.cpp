#include "renderer/metrics/flip_difference.h"

#include <bit>
#include <cmath>
#include <cstdint>

#include "renderer/metrics/flip_color.h"

namespace helio {
namespace {

// Andersson et al. 2020, colour pipeline, the redistribution of errors: differences to the power kExponent; the first
// line ends at kLineEnd of the largest, and there at kLineValue.
constexpr float kExponent = 0.7f;
constexpr float kLineEnd = 0.4f, kLineValue = 0.95f;

// x^exponent, x and exponent >= 0, x at most 1e30, relative error below 1e-5: std::pow, which no vector instruction
// has, took half of FLIP's time. log2 by the series of artanh((m - 1) / (m + 1)), m in [sqrt(1/2), sqrt(2)); 2^f by its
// series, f in [-1/2, 1/2].
inline float power(float x, float exponent) {
  constexpr float kLeast = 1e-30f;
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(x > kLeast ? x : kLeast);
  const auto scale = std::int32_t(bits - 0x3f3504f3u) >> 23;
  const float m = std::bit_cast<float>(bits - (std::uint32_t(scale) << 23));
  const float t = (m - 1) / (m + 1), t2 = t * t;
  const float log2 = float(scale) + t * (2.885390082f + t2 * (0.961796694f + t2 * (0.577078016f + t2 * 0.412198583f)));
  const float product = exponent * log2;
  const float y = product > -126 ? product : -126;
  const auto whole = std::int32_t(y + (y < 0 ? -0.5f : 0.5f));
  const float f = y - float(whole);
  const float root =
      1 +
      f * (0.693147181f + f * (0.240226507f + f * (0.0555041087f +
                                                   f * (0.00961812911f + f * (0.00133335581f + f * 0.000154035304f)))));
  const float result = root * std::bit_cast<float>(std::uint32_t(whole + 127) << 23);
  // Products, because g++ makes branches of more choices, and a loop with branches no vector instructions.
  const float positive = x > 0 ? 1.0f : 0.0f, of_zero = exponent > 0 ? 0.0f : 1.0f;
  return positive * result + (1 - positive) * of_zero;
}

// Between green and blue, the largest that linear RGB in [0, 1] allows.
float largest_color_difference() {
  const HuntLab green = hunt_lab(kWhiteXFromRgb[1], kWhiteYFromRgb[1], kWhiteZFromRgb[1]);
  const HuntLab blue = hunt_lab(kWhiteXFromRgb[2], kWhiteYFromRgb[2], kWhiteZFromRgb[2]);
  return std::pow(hyab_distance(green, blue), kExponent);
}

void color_differences(const ObservedRow& x, const ObservedRow& r, float* __restrict out, std::size_t width) {
  const float* __restrict xl = x.l, * __restrict xa = x.a, * __restrict xb = x.b;
  const float* __restrict rl = r.l, * __restrict ra = r.a, * __restrict rb = r.b;
  for (std::size_t i = 0; i < width; ++i) out[i] = hyab_distance({xl[i], xa[i], xb[i]}, {rl[i], ra[i], rb[i]});
}

// The larger change of edges and points (Andersson et al. 2020, feature pipeline).
void feature_differences(const ObservedRow& x, const ObservedRow& r, float* __restrict out, std::size_t width) {
  const float* __restrict x_edge = x.edge, * __restrict x_point = x.point;
  const float* __restrict r_edge = r.edge, * __restrict r_point = r.point;
  for (std::size_t i = 0; i < width; ++i) {
    const float edge = std::abs(x_edge[i] - r_edge[i]), point = std::abs(x_point[i] - r_point[i]);
    out[i] = std::sqrt((edge > point ? edge : point) * 0.70710678f);
  }
}

// error = max(error, the difference redistributed, to the power of 1 - feature), the final error of Andersson et al.
// 2020.
void redistribute(const float* __restrict difference, const float* __restrict feature, float largest,
                  float* __restrict error, std::size_t width) {
  const float end = kLineEnd * largest, first = kLineValue / end;
  const float second = (1 - kLineValue) / (largest - end);
  for (std::size_t i = 0; i < width; ++i) {
    const float d = power(difference[i], kExponent);
    const float above = kLineValue + (d - end) * second;
    const float on_first = first * d, on_second = above < 1 ? above : 1;
    const float color = d < end ? on_first : on_second;
    const float left = 1 - feature[i], exponent = left > 0 ? left : 0;
    const float value = power(color, exponent);
    const float most = error[i];
    error[i] = value > most ? value : most;
  }
}

}  // namespace

FlipDifference::FlipDifference(int width)
    : largest_(largest_color_difference()), color_(std::size_t(width)), feature_(std::size_t(width)) {}

void FlipDifference::add(const ObservedRow& picture, const ObservedRow& reference, float* error) {
  color_differences(picture, reference, color_.data(), color_.size());
  feature_differences(picture, reference, feature_.data(), feature_.size());
  redistribute(color_.data(), feature_.data(), largest_, error, color_.size());
}

}  // namespace helio
