// Directions distributed uniformly over the solid angle of a rectangle or a triangle:
// trace/sampling/solid_angle_sampling.cpp, which names the papers.
#ifndef SOLID_ANGLE_SAMPLING_GLSL
#define SOLID_ANGLE_SAMPLING_GLSL

#include "base/arc_tangent.glsl"
#include "base/base.glsl"
#include "base/circle.glsl"

const float kMinSolidAngle = 0.02;

// The part of v perpendicular to the unit vector w, normalized; zero when there is none.
vec3 perpendicular_part(vec3 v, vec3 w) {
  const vec3 rest = v - w * dot(v, w);
  const float squared = length_squared(rest);
  return squared > 0 ? rest * (1 / sqrt(squared)) : vec3(0);
}

// (cosine, sine) of the angle at corner `a` between the great circles to b and to c.
vec2 corner_angle(vec3 a, vec3 b, vec3 c) {
  const vec3 ab = cross(a, b), ac = cross(a, c);
  const float scale = 1 / sqrt(max(length_squared(ab) * length_squared(ac), 1e-30));
  return vec2(clamp(dot(ab, ac) * scale, -1.0, 1.0), clamp(abs(dot(a, cross(b, c))) * scale, 0.0, 1.0));
}

// The sum, in [0, 2 pi), of two angles in [0, pi) given as (cosine, sine) times any length.
float sum_of_angles(vec2 a, vec2 b) {
  const float angle = arc_tangent(a.x * b.y + a.y * b.x, a.x * b.x - a.y * b.y);
  return angle < 0 ? angle + kTwoPi : angle;
}

struct SphericalRectangle {
  float x0, x1, y0, y1, z0, b0, b1, k;
  float solid_angle;  // steradian, [0, 2 pi]
};

SphericalRectangle make_spherical_rectangle(vec3 point, vec3 corner, vec3 e1, vec3 e2) {
  SphericalRectangle r;
  const float l1 = length(e1), l2 = length(e2);
  const vec3 x = e1 * (1 / l1), y = e2 * (1 / l2), d = corner - point;
  r.x0 = dot(d, x);
  r.y0 = dot(d, y);
  r.z0 = -abs(dot(d, cross(x, y)));
  r.x1 = r.x0 + l1;
  r.y1 = r.y0 + l2;
  const float zz = r.z0 * r.z0, h = -r.z0;
  const float xx0 = r.x0 * r.x0, xx1 = r.x1 * r.x1, yy0 = r.y0 * r.y0, yy1 = r.y1 * r.y1;
  // Inner angles g_i: cos g = -n_i . n_(i+1), sin g = |n_i x n_(i+1)|, up to |n_i| |n_(i+1)|.
  r.k = kTwoPi - sum_of_angles(vec2(r.x0 * r.y1, h * sqrt(xx0 + yy1 + zz)),
                               vec2(-r.x0 * r.y0, h * sqrt(xx0 + yy0 + zz)));
  const float others = sum_of_angles(vec2(r.x1 * r.y0, h * sqrt(xx1 + yy0 + zz)),
                                     vec2(-r.x1 * r.y1, h * sqrt(xx1 + yy1 + zz)));
  r.solid_angle = max(0.0, others - r.k);
  r.b0 = -r.y0 / sqrt(max(yy0 + zz, 1e-30));
  r.b1 = r.y1 / sqrt(max(yy1 + zz, 1e-30));
  return r;
}

// (s, t) of the point whose direction is uniform in solid angle. Precondition: r.solid_angle > 0.
vec2 sample_spherical_rectangle(SphericalRectangle r, vec2 u) {
  const vec2 angle = unit_circle((u.x * r.solid_angle + r.k) / kTwoPi);
  const float sine = angle.y;
  const float fu = (angle.x * r.b0 - r.b1) / (abs(sine) > 1e-9 ? sine : copysign(1e-9, sine));
  const float cu = clamp(copysign(1 / sqrt(fu * fu + r.b0 * r.b0), fu), -1.0, 1.0);
  const float xu = clamp(-(cu * r.z0) / max(safe_sqrt(1 - cu * cu), 1e-7), r.x0, r.x1);
  const float dd = xu * xu + r.z0 * r.z0;
  const float h0 = r.y0 / sqrt(dd + r.y0 * r.y0), h1 = r.y1 / sqrt(dd + r.y1 * r.y1);
  const float hv = h0 + u.y * (h1 - h0), rest = 1 - hv * hv;
  const float yv = rest > 1e-6 ? clamp(hv * sqrt(dd / rest), r.y0, r.y1) : (hv > 0 ? r.y1 : r.y0);
  return vec2(clamp((xu - r.x0) / (r.x1 - r.x0), 0.0, 1.0), clamp((yv - r.y0) / (r.y1 - r.y0), 0.0, 1.0));
}

struct SphericalTriangle {
  vec3 a, b, c;       // unit directions to the corners
  float solid_angle;  // steradian, [0, 2 pi]
};

vec3 unit_or_short(vec3 v) {
  return v * (1 / sqrt(max(length_squared(v), 1e-30)));
}

SphericalTriangle make_spherical_triangle(vec3 point, vec3 p0, vec3 e1, vec3 e2) {
  SphericalTriangle t;
  const vec3 d = p0 - point;
  t.a = unit_or_short(d);
  t.b = unit_or_short(d + e1);
  t.c = unit_or_short(d + e2);
  const float triple = abs(dot(t.a, cross(t.b, t.c)));
  t.solid_angle = 2 * arc_tangent(triple, 1 + dot(t.a, t.b) + dot(t.b, t.c) + dot(t.c, t.a));
  if (t.solid_angle < 0) t.solid_angle += kTwoPi;
  return t;
}

// Unit direction, uniform in solid angle. Precondition: t.solid_angle > 0.
vec3 sample_spherical_triangle(SphericalTriangle t, vec2 u) {
  const vec2 alpha = corner_angle(t.a, t.b, t.c);  // cosine, sine
  // Corner c' on the arc ac such that (a, b, c') has the area u.x * solid_angle.
  const vec2 area = unit_circle(u.x * t.solid_angle / kTwoPi);
  const float sin_phi = area.y * alpha.x - area.x * alpha.y, cos_phi = area.x * alpha.x + area.y * alpha.y;
  const float k1 = cos_phi - alpha.x, k2 = sin_phi + alpha.y * dot(t.a, t.b);
  const float denominator = (k2 * sin_phi + k1 * cos_phi) * alpha.y;
  const float cos_b =
      denominator != 0 ? clamp(((k2 * cos_phi - k1 * sin_phi) * alpha.x - k2) / denominator, -1.0, 1.0) : 1.0;
  const vec3 c = t.a * cos_b + perpendicular_part(t.c, t.a) * safe_sqrt(1 - cos_b * cos_b);
  const float z = 1 - u.y * (1 - dot(c, t.b));
  return normalize(t.b * z + perpendicular_part(c, t.b) * safe_sqrt(1 - z * z));
}

#endif
