// Rays and what they meet: struct Ray and struct Hit of trace/accel/accel.h.
#ifndef RAY_GLSL
#define RAY_GLSL

#include "base/base.glsl"
#include "tables/base.h"

struct Ray {
  vec3 origin;
  float t_max;     // > 0; occlusion rays end before the light's surface
  vec3 direction;  // unit
  uint alpha_key;  // decides, per hit, whether a blended surface lets this ray through
};

// `part` is kNone where the ray met nothing.
struct Hit {
  float t, u, v;   // barycentrics of the second and third corner
  vec3 normal;     // geometric, not normalised; in the object's space when instance != kNone
  uint part;       // flat part; inside an instance: part of the object
  uint primitive;
  uint instance;   // kNone for geometry of the top level
};

Hit no_hit(float t_max) {
  return Hit(t_max, 0, 0, vec3(0), kNone, kNone, kNone);
}

#endif
