// Orthonormal frame around a unit normal n (Duff et al. 2017): struct Frame of renderer/base/math.h.
#ifndef FRAME_GLSL
#define FRAME_GLSL

#include "base/base.glsl"

struct Frame {
  vec3 s, t, n;
};

Frame make_frame(vec3 n) {
  const float sign_z = copysign(1.0, n.z);
  const float a = -1.0 / (sign_z + n.z);
  const float b = n.x * n.y * a;
  return Frame(vec3(1.0 + sign_z * n.x * n.x * a, sign_z * b, -sign_z * n.x), vec3(b, sign_z + n.y * n.y * a, -n.y), n);
}

vec3 to_local(Frame f, vec3 v) {
  return vec3(dot(v, f.s), dot(v, f.t), dot(v, f.n));
}
vec3 to_world(Frame f, vec3 v) {
  return f.s * v.x + f.t * v.y + f.n * v.z;
}

#endif
