// Where a ray meets a sphere: Embree's test, term by term.
#ifndef SPHERE_HIT_GLSL
#define SPHERE_HIT_GLSL

#include "base/base.glsl"

struct SphereHit {
  float middle;       // the ray's parameter where it is closest to the centre
  float half_length;  // from there to either side; negative: a miss
  vec3 off;           // from that point to the centre
};

SphereHit meet_sphere(vec3 origin, vec3 direction, vec3 center, float radius) {
  SphereHit hit;
  const float inverse = 1 / dot(direction, direction);
  const vec3 to_center = center - origin;
  hit.middle = dot(to_center, direction) * inverse;
  hit.off = to_center - hit.middle * direction;
  const float left = radius * radius - dot(hit.off, hit.off);
  hit.half_length = left >= 0 ? sqrt(left * inverse) : -1.0;
  return hit;
}

// The normal of a sphere on its near or its far side, outwards, as long as the radius.
vec3 sphere_normal(SphereHit hit, vec3 direction, bool near_side) {
  return direction * (near_side ? -hit.half_length : hit.half_length) - hit.off;
}

#endif
