// Which rays are traced at all: those that float can carry, as Accel does (trace/accel/accel.h).
#ifndef RAY_RANGE_GLSL
#define RAY_RANGE_GLSL

#include "accel/ray.glsl"

// False: the ray hits nothing and is occluded. Comparisons are by bits, for NaN's sake: positive floats order as their
// bits do, and NaN lies beyond all of them.
bool is_traceable(Ray ray, float limit) {
  const vec3 sum = abs(ray.origin) + abs(ray.direction);
  const uint reach = floatBitsToUint(sum.x + sum.y + sum.z), t_max = floatBitsToUint(ray.t_max);
  return reach <= floatBitsToUint(limit) && (t_max <= 0x7f800000u || t_max == 0x80000000u);
}

#endif
