// Maps from uniform variates in [0, 1)^2 to distributions: trace/sampling/warp.h.
#ifndef WARP_GLSL
#define WARP_GLSL

#include "base/base.glsl"

// Concentric map to the unit disk (Shirley and Chiu 1997), with the polynomials of warp.h.
vec2 square_to_disk(vec2 u) {
  const float a = 2 * u.x - 1, b = 2 * u.y - 1;
  const bool wide = abs(a) > abs(b);
  const float radius = wide ? a : b;
  const float ratio = (wide ? b : a) / (radius != 0 ? radius : 1.0);
  const float phi = (kPi / 4) * ratio, phi2 = phi * phi;
  const float sine = phi * (1 + phi2 * (-1.0 / 6 + phi2 * (1.0 / 120 + phi2 * (-1.0 / 5040 + phi2 / 362880))));
  const float cosine = 1 + phi2 * (-0.5 + phi2 * (1.0 / 24 + phi2 * (-1.0 / 720 + phi2 / 40320)));
  const float major = radius * cosine, minor = radius * sine;
  return wide ? vec2(major, minor) : vec2(minor, major);
}

vec3 square_to_cosine_hemisphere(vec2 u) {
  const vec2 disk = square_to_disk(u);
  const float radius = max(abs(2 * u.x - 1), abs(2 * u.y - 1));
  return vec3(disk, sqrt((1 - radius) * (1 + radius)));
}
float cosine_hemisphere_pdf_w(float cos_theta) {
  return max(0.0, cos_theta) * kInvPi;
}

vec3 square_to_sphere(vec2 u) {
  const float sin2_half = u.y;  // z = 1 - 2 u.y
  const float radius = 2 * sqrt(sin2_half * (1 - sin2_half)), phi = kTwoPi * u.x;
  return vec3(radius * cos(phi), radius * sin(phi), 1 - 2 * sin2_half);
}
const float kSpherePdfW = kInvPi / 4;

vec3 square_to_cone(vec2 u, float one_minus_cos_max) {
  const float h = u.y * one_minus_cos_max;  // 1 - cos theta
  const float radius = sqrt(h * (2 - h)), phi = kTwoPi * u.x;
  return vec3(radius * cos(phi), radius * sin(phi), 1 - h);
}
float cone_pdf_w(float one_minus_cos_max) {
  return 1 / (kTwoPi * one_minus_cos_max);
}

// Barycentrics, uniform over a triangle (Heitz 2019).
vec2 square_to_triangle(vec2 u) {
  float x = u.x, y = u.y;
  if (y > x) {
    x *= 0.5;
    y -= x;
  } else {
    y *= 0.5;
    x -= y;
  }
  return vec2(x, y);
}

#endif
