// Where a ray meets a triangle, without gaps between neighbours: in a space sheared along the ray, where an edge is the
// same numbers for both of its triangles (Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection").
#ifndef TRIANGLE_HIT_GLSL
#define TRIANGLE_HIT_GLSL

#include "base/base.glsl"

struct RayShear {
  vec3 factors;  // of the permuted direction
  uint axis;     // along which the direction is longest
};

// Turns the coordinates so that `axis` becomes the last one.
vec3 permute(vec3 v, uint axis) {
  return axis == 0 ? v.yzx : axis == 1 ? v.zxy : v;
}

RayShear make_ray_shear(vec3 direction) {
  const vec3 size = abs(direction);
  RayShear shear;
  shear.axis = size.z >= size.x && size.z >= size.y ? 2 : size.y >= size.x ? 1 : 0;
  const vec3 turned = permute(direction, shear.axis);
  shear.factors = vec3(turned.xy / turned.z, 1.0 / turned.z);
  return shear;
}

// The weights of the corners where the line of the ray passes, up to a factor, and in `depths` the corners' distances
// along it. All of one sign, zero included: the line meets the triangle.
vec3 corner_weights(vec3 origin, RayShear shear, vec3 a, vec3 b, vec3 c, out vec3 depths) {
  precise const vec3 pa = permute(a - origin, shear.axis);
  precise const vec3 pb = permute(b - origin, shear.axis);
  precise const vec3 pc = permute(c - origin, shear.axis);
  precise const vec2 qa = pa.xy - shear.factors.xy * pa.z;
  precise const vec2 qb = pb.xy - shear.factors.xy * pb.z;
  precise const vec2 qc = pc.xy - shear.factors.xy * pc.z;
  depths = vec3(pa.z, pb.z, pc.z) * shear.factors.z;
  precise const vec3 first = vec3(qc.x, qa.x, qb.x) * vec3(qb.y, qc.y, qa.y);
  precise const vec3 second = vec3(qc.y, qa.y, qb.y) * vec3(qb.x, qc.x, qa.x);
  // A difference of rounded products is of the right sign or zero. Two triangles that share an edge get the same
  // difference, or its negative; where it is zero the ray meets both triangles.
  precise const vec3 weights = first - second;
  return weights;
}

// Distance and barycentrics (of the second and third corner) where the ray meets the triangle in (0, t_max).
bool meet_triangle(vec3 origin, RayShear shear, vec3 a, vec3 b, vec3 c, float t_max, out vec3 hit) {
  vec3 depths;
  const vec3 weights = corner_weights(origin, shear, a, b, c, depths);
  const float least = min(weights.x, min(weights.y, weights.z)), most = max(weights.x, max(weights.y, weights.z));
  const float sum = weights.x + weights.y + weights.z;
  if ((least < 0 && most > 0) || sum == 0) return false;
  const vec3 shares = weights * (1 / sum);
  hit = vec3(dot(shares, depths), shares.yz);
  return hit.x > 0 && hit.x < t_max;
}

// Barycentrics where a ray has met the triangle, by another test than this one.
vec2 barycentrics_of(vec3 origin, vec3 direction, vec3 a, vec3 b, vec3 c) {
  vec3 depths;
  const vec3 weights = corner_weights(origin, make_ray_shear(direction), a, b, c, depths);
  const float sum = weights.x + weights.y + weights.z;
  const vec2 b_c = clamp(sum != 0 ? weights.yz / sum : vec2(0), 0.0, 1.0);
  return b_c / max(1.0, b_c.x + b_c.y);
}

#endif
