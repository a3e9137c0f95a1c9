// What raygen shaders exchange with hit and miss shaders.
#ifndef RAY_PAYLOAD_GLSL
#define RAY_PAYLOAD_GLSL

#include "accel/ray.glsl"

struct RayPayload {
  Hit hit;         // out: part kNone for a miss
  uint alpha_key;  // in: Ray::alpha_key
};

#endif
