// Maps from uniform variates in [0, 1)^2 to distributions over disks, directions and triangles, with their densities.
#pragma once

#include "renderer/base/math.h"

namespace helio {

// Unit disk, uniform: concentric squares to concentric circles (Shirley and Chiu 1997), so that strata stay compact.
// The angle within a quadrant is at most pi / 4, where the Taylor polynomials below err by less than 1e-7 (sine) and
// 3e-8 (cosine): no library call, and the loop around it vectorises.
inline V2f square_to_disk(const V2f& u) {
  const float a = 2 * u.x - 1, b = 2 * u.y - 1;
  const bool wide = std::fabs(a) > std::fabs(b);
  const float radius = wide ? a : b;
  const float ratio = (wide ? b : a) / (radius != 0 ? radius : 1.0f);
  const float phi = (kPi / 4) * ratio, phi2 = phi * phi;
  const float sine = phi * (1 + phi2 * (-1.0f / 6 + phi2 * (1.0f / 120 + phi2 * (-1.0f / 5040 + phi2 / 362880))));
  const float cosine = 1 + phi2 * (-0.5f + phi2 * (1.0f / 24 + phi2 * (-1.0f / 720 + phi2 / 40320)));
  const float major = radius * cosine, minor = radius * sine;
  return wide ? V2f(major, minor) : V2f(minor, major);
}

// Hemisphere around +z with density cos / pi (Malley). The z component is 0 only for a variate of exactly 0.
inline V3f square_to_cosine_hemisphere(const V2f& u) {
  const V2f disk = square_to_disk(u);
  const float radius = std::max(std::fabs(2 * u.x - 1), std::fabs(2 * u.y - 1));
  return {disk.x, disk.y, std::sqrt((1 - radius) * (1 + radius))};
}
inline float cosine_hemisphere_pdf_w(float cos_theta) {
  return std::max(0.0f, cos_theta) * kInvPi;
}

// Whole sphere, uniform: density 1 / (4 pi).
inline V3f square_to_sphere(const V2f& u) {
  const float sin2_half = u.y;  // z = 1 - 2 u.y
  const float radius = 2 * std::sqrt(sin2_half * (1 - sin2_half)), phi = kTwoPi * u.x;
  return {radius * std::cos(phi), radius * std::sin(phi), 1 - 2 * sin2_half};
}
inline constexpr float kSpherePdfW = kInvPi / 4;

// Cone around +z given by 1 - cos of its half angle, which keeps narrow cones exact. Uniform in solid angle.
inline V3f square_to_cone(const V2f& u, float one_minus_cos_max) {
  const float h = u.y * one_minus_cos_max;  // 1 - cos theta
  const float radius = std::sqrt(h * (2 - h)), phi = kTwoPi * u.x;
  return {radius * std::cos(phi), radius * std::sin(phi), 1 - h};
}
inline float cone_pdf_w(float one_minus_cos_max) {
  return 1 / (kTwoPi * one_minus_cos_max);
}

// Barycentric weights (of the second and third corner) of a uniform point in a triangle, without a square root and
// with little distortion (Heitz 2019, "A Low-Distortion Map Between Triangle and Square").
inline V2f square_to_triangle(const V2f& u) {
  float x = u.x, y = u.y;
  if (y > x) {
    x *= 0.5f;
    y -= x;
  } else {
    y *= 0.5f;
    x -= y;
  }
  return {x, y};
}

}  // namespace helio
