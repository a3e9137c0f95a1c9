// Points on the unit circle. Vulkan lets sin() and cos() be off by 2^-11, which would give directions of a wrong
// length; these err by less than 1e-6 on every device.
#ifndef CIRCLE_GLSL
#define CIRCLE_GLSL

#include "base/base.glsl"

// Cosine and sine of `turns` in [0, 1] whole turns: Taylor polynomials on an eighth of a turn.
vec2 unit_circle(float turns) {
  const float quarters = 4 * turns, quarter = floor(quarters + 0.5);
  const float phi = (kPi / 2) * (quarters - quarter), phi2 = phi * phi;
  const float sine = phi * (1 + phi2 * (-1.0 / 6 + phi2 * (1.0 / 120 + phi2 * (-1.0 / 5040 + phi2 / 362880))));
  const float cosine = 1 + phi2 * (-0.5 + phi2 * (1.0 / 24 + phi2 * (-1.0 / 720 + phi2 / 40320)));
  const uint turned = uint(quarter) & 3u;
  const vec2 swapped = (turned & 1u) != 0 ? vec2(-sine, cosine) : vec2(cosine, sine);
  return (turned & 2u) != 0 ? -swapped : swapped;
}

#endif
