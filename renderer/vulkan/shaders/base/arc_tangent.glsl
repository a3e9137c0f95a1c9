// Arc tangent and arc cosine to about two units in the last place. Vulkan lets atan() be off by 4096 of them, which
// moves a direction into the next cell of an environment's distribution. The polynomial is that of S. Moshier's Cephes,
// atanf.c.
#ifndef ARC_TANGENT_GLSL
#define ARC_TANGENT_GLSL

#include "base/base.glsl"

// std::atan2 of finite numbers.
float arc_tangent(float y, float x) {
  const float low = min(abs(x), abs(y)), high = max(abs(x), abs(y));
  const bool steep = low > 0.41421356 * high;  // tan(pi / 8)
  const float divisor = steep ? low + high : high;
  const float t = divisor > 0 ? (steep ? low - high : low) / divisor : 0.0;
  const float z = t * t;
  float angle = (((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1) * z * t + t;
  angle += steep ? kPi / 4 : 0.0;
  angle = abs(y) > abs(x) ? kPi / 2 - angle : angle;
  angle = floatBitsToInt(x) < 0 ? kPi - angle : angle;
  return copysign(angle, y);
}

// std::acos; -1 <= x <= 1.
float arc_cosine(float x) {
  return arc_tangent(sqrt((1 - x) * (1 + x)), x);
}

#endif
