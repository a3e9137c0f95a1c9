// The shapes of area lights: sample a direction to one, and the density of a direction found otherwise:
// trace/lights/light_shapes.{h,cpp}. shape_pdf_w() takes the same decisions as sample_shape() from the same point.
#ifndef LIGHT_SHAPES_GLSL
#define LIGHT_SHAPES_GLSL

#include "base/base.glsl"
#include "base/circle.glsl"
#include "base/frame.glsl"
#include "lights/light_features.glsl"
#include "sampling/solid_angle_sampling.glsl"
#include "tables/lights.h"
#include "sampling/warp.glsl"

struct ShapeSample {
  vec3 direction;  // unit, from the point to the light
  float distance;
  float pdf_w;      // 0: no sample
  float cos_light;  // |cosine| between the direction and the shape's normal where it meets the shape
  vec2 st;          // planar: the point is p0 + st.x e1 + st.y e2
};

const ShapeSample kNoShapeSample = ShapeSample(vec3(0), 0, 0, 1, vec2(0));
const float kMaxShapePdf = 1e30;

// Densities above kMaxShapePdf become 0, and so do NaN and infinity. Floats are compared by their bits, which order
// those >= 0.
float accept_pdf(float pdf) {
  return floatBitsToUint(pdf) <= floatBitsToUint(kMaxShapePdf) ? pdf : 0.0;
}

const uint kHasPlanarLights = kHasTriangles | kHasParallelograms, kHasRoundLights = kHasSpheres | kHasEllipsoids;

uint shape_kind(AreaLightTable shape) {
  return shape.flags & kShapeKindMask;
}
bool is_ellipsoid(AreaLightTable shape) {
  return has_light_feature(kHasEllipsoids) && shape_kind(shape) == kShapeEllipsoid;
}
// True for a sphere and an ellipsoid; the other shapes are planar.
bool is_round(AreaLightTable shape) {
  return has_light_feature(kHasRoundLights) &&
         (!has_light_feature(kHasPlanarLights) || shape_kind(shape) >= kShapeSphere);
}
bool is_triangle(AreaLightTable shape) {
  return has_light_feature(kHasTriangles) && shape_kind(shape) == kShapeTriangle;
}
bool shape_two_sided(AreaLightTable shape) {
  return (shape.flags & kShapeTwoSided) != 0;
}
// Whether the point is so near to a planar shape that the solid angle is sampled.
bool shape_is_near(AreaLightTable shape, vec3 point) {
  return length_squared(shape.center - point) < shape.near_squared;
}

// The linear map of the unit sphere to an ellipsoid, and its inverse, whose rows are cofactors over the determinant.
struct LinearMap {
  vec3 e1, e2, e3, c1, c2, c3;
  float determinant;
};

LinearMap make_linear_map(AreaLightTable shape) {
  LinearMap map;
  map.e1 = shape.e1;
  map.e2 = shape.e2;
  map.e3 = shape.e3;
  map.c1 = cross(shape.e2, shape.e3);
  map.c2 = cross(shape.e3, shape.e1);
  map.c3 = cross(shape.e1, shape.e2);
  map.determinant = dot(map.e1, map.c1);
  return map;
}
vec3 apply_map(LinearMap map, vec3 v) {
  return map.e1 * v.x + map.e2 * v.y + map.e3 * v.z;
}
vec3 invert_map(LinearMap map, vec3 v) {
  return vec3(dot(map.c1, v), dot(map.c2, v), dot(map.c3, v)) * (1 / map.determinant);
}
vec3 apply_cofactors(LinearMap map, vec3 v) {
  return map.c1 * v.x + map.c2 * v.y + map.c3 * v.z;
}

// Direction, in the unit sphere's space, of a point of a sphere or ellipsoid. Not unit.
vec3 local_direction(AreaLightTable shape, vec3 surface_point) {
  const vec3 from_center = surface_point - shape.center;
  return is_ellipsoid(shape) ? invert_map(make_linear_map(shape), from_center) : from_center;
}

// Area sampling of a planar shape at p0 + s e1 + t e2.
ShapeSample sample_planar_area(AreaLightTable shape, vec3 point, vec2 st) {
  ShapeSample drawn;
  const vec3 to_light = (shape.p0 - point) + shape.e1 * st.x + shape.e2 * st.y;
  const float front = -dot(shape.normal, to_light);
  const float height = shape_two_sided(shape) ? abs(front) : front;
  const float squared = length_squared(to_light), distance = sqrt(squared);
  const float inverse = 1 / distance;
  drawn.direction = to_light * inverse;
  drawn.cos_light = height * inverse;
  drawn.distance = distance;
  drawn.pdf_w = height > 0 ? accept_pdf(squared * distance / (height * shape.area)) : 0.0;
  drawn.st = st;
  return drawn;
}

// The sample along a known direction: distance and (s, t) by intersecting the plane.
ShapeSample sample_along(AreaLightTable shape, vec3 point, vec3 direction, float solid_angle) {
  const float cosine = dot(shape.normal, direction);
  const float facing = shape_two_sided(shape) ? abs(cosine) : -cosine;
  const vec3 d = shape.p0 - point;
  if (!(facing > 0)) return kNoShapeSample;
  const float distance = dot(shape.normal, d) / cosine;
  if (!(distance > 0)) return kNoShapeSample;
  const vec3 in_plane = direction * distance - d, n = cross(shape.e1, shape.e2);
  const float inverse = 1 / length_squared(n);
  ShapeSample drawn;
  drawn.st.x = clamp(dot(cross(in_plane, shape.e2), n) * inverse, 0.0, 1.0);
  drawn.st.y = clamp(dot(cross(shape.e1, in_plane), n) * inverse, 0.0, 1.0 - drawn.st.x);
  drawn.direction = direction;
  drawn.distance = distance;
  drawn.cos_light = facing;
  drawn.pdf_w = 1 / solid_angle;
  return drawn;
}

float near_planar_pdf_w(AreaLightTable shape, vec3 point, float distance, float cosine) {
  const float solid_angle = is_triangle(shape)
                                ? make_spherical_triangle(point, shape.p0, shape.e1, shape.e2).solid_angle
                                : make_spherical_rectangle(point, shape.p0, shape.e1, shape.e2).solid_angle;
  if (solid_angle >= kMinSolidAngle) return 1 / solid_angle;
  return accept_pdf(distance * distance / (cosine * shape.area));
}

// A direction to a sphere: from outside, uniform over the cone that it fills; from inside, uniform over all directions.
ShapeSample sample_sphere(vec3 center, float radius, bool two_sided, vec3 point, vec2 u) {
  ShapeSample drawn = kNoShapeSample;
  const vec3 to_center = center - point;
  const float squared = length_squared(to_center), radius_squared = sqr(radius);
  const vec2 around = unit_circle(u.y);
  if (!(squared > radius_squared)) {
    if (!two_sided) return drawn;
    const float z = 1 - 2 * u.x, r = safe_sqrt(1 - z * z);
    drawn.direction = vec3(r * around.x, r * around.y, z);
    const float along = dot(drawn.direction, to_center), depth = radius_squared - squared;
    const float root = sqrt(along * along + depth);
    drawn.distance = along > 0 ? along + root : depth / (root - along);
    drawn.cos_light = root / radius;
    drawn.pdf_w = drawn.distance > 0 ? kInvPi / 4 : 0.0;
    return drawn;
  }
  const float distance = sqrt(squared), sine_squared = radius_squared / squared;
  const float cap = sine_squared / (1 + safe_sqrt(1 - sine_squared));  // 1 - cos of the cone's half angle
  const float below = u.x * cap;                                       // 1 - cos of the sampled angle
  const float sine = sqrt(below * (2 - below));
  const Frame frame = make_frame(to_center * (1 / distance));
  drawn.direction = to_world(frame, vec3(sine * around.x, sine * around.y, 1 - below));
  const float root = safe_sqrt(radius_squared - squared * sqr(sine));
  drawn.distance = distance * (1 - below) - root;
  drawn.cos_light = root / radius;
  drawn.pdf_w = drawn.distance > 0 ? accept_pdf(kInvPi / (2 * cap)) : 0.0;
  return drawn;
}

float sphere_pdf_w(vec3 center, float radius, bool two_sided, vec3 point, float cos_light) {
  const float squared = length_squared(center - point), radius_squared = sqr(radius);
  if (!(squared > radius_squared)) return two_sided && cos_light < 0 ? kInvPi / 4 : 0.0;
  if (!(cos_light > 0)) return 0;  // the far side, seen through an opening: never sampled
  const float sine_squared = radius_squared / squared;
  const float cap = sine_squared / (1 + safe_sqrt(1 - sine_squared));
  return accept_pdf(kInvPi / (2 * cap));
}

// A direction `drawn` to the unit sphere from `local_point`, carried over by the map A that makes the ellipsoid: it
// takes the solid angle dw' around w' to |det A| / |A w'|^3 dw'.
ShapeSample carry_over(LinearMap map, vec3 local_point, ShapeSample drawn) {
  const vec3 normal = apply_cofactors(map, local_point + drawn.direction * drawn.distance);
  const vec3 direction = apply_map(map, drawn.direction);
  const float stretch = length(direction);
  drawn.direction = direction * (1 / stretch);
  drawn.distance *= stretch;
  drawn.cos_light = abs(dot(normalize(normal), drawn.direction));
  drawn.pdf_w = accept_pdf(drawn.pdf_w * stretch * stretch * stretch / abs(map.determinant));
  return drawn;
}

ShapeSample sample_round(AreaLightTable shape, vec3 point, vec2 u) {
  const bool ellipsoid = is_ellipsoid(shape);
  const LinearMap map = make_linear_map(shape);
  const vec3 center = ellipsoid ? vec3(0) : shape.center;
  const vec3 from = ellipsoid ? invert_map(map, point - shape.center) : point;
  const ShapeSample drawn = sample_sphere(center, ellipsoid ? 1.0 : shape.radius, shape_two_sided(shape), from, u);
  if (!ellipsoid) return drawn;
  if (!(drawn.pdf_w > 0)) return kNoShapeSample;
  return carry_over(map, from, drawn);
}

float round_pdf_w(AreaLightTable shape, vec3 point, vec3 direction, float cos_light) {
  const bool ellipsoid = is_ellipsoid(shape);
  const LinearMap map = make_linear_map(shape);
  const vec3 center = ellipsoid ? vec3(0) : shape.center;
  const vec3 from = ellipsoid ? invert_map(map, point - shape.center) : point;
  const float pdf_w = sphere_pdf_w(center, ellipsoid ? 1.0 : shape.radius, shape_two_sided(shape), from, cos_light);
  if (!ellipsoid) return pdf_w;
  const float stretch = 1 / length(invert_map(map, direction));
  return accept_pdf(pdf_w * stretch * stretch * stretch / abs(map.determinant));
}

// Samples the solid angle of a planar shape that is near, where that is not too small, and else the area.
ShapeSample sample_planar(AreaLightTable shape, vec3 point, vec2 u) {
  const bool triangular = is_triangle(shape);
  vec2 st = triangular ? square_to_triangle(u) : u;
  float solid_angle = 0;
  if (shape_is_near(shape, point)) {
    if (!shape_two_sided(shape) && !(dot(shape.normal, point - shape.p0) > 0)) return kNoShapeSample;
    if (triangular) {
      const SphericalTriangle triangle = make_spherical_triangle(point, shape.p0, shape.e1, shape.e2);
      if (triangle.solid_angle >= kMinSolidAngle)
        return sample_along(shape, point, sample_spherical_triangle(triangle, u), triangle.solid_angle);
    } else if (has_light_feature(kHasParallelograms)) {
      const SphericalRectangle rectangle = make_spherical_rectangle(point, shape.p0, shape.e1, shape.e2);
      if (rectangle.solid_angle >= kMinSolidAngle) {
        solid_angle = rectangle.solid_angle;
        st = sample_spherical_rectangle(rectangle, u);
      }
    }
  }
  ShapeSample drawn = sample_planar_area(shape, point, st);
  if (solid_angle > 0 && drawn.pdf_w > 0) drawn.pdf_w = 1 / solid_angle;
  return drawn;
}

// A direction from `point` to the shape; u in [0, 1)^2.
ShapeSample sample_shape(AreaLightTable shape, vec3 point, vec2 u) {
  if (is_round(shape)) return sample_round(shape, point, u);
  return sample_planar(shape, point, u);
}

// Solid angle density of sample_shape() at `point` for the unit direction that hit the shape at `distance`, where the
// cosine between the front normal and the direction back to the point is cos_light.
float shape_pdf_w(AreaLightTable shape, vec3 point, vec3 direction, float distance, float cos_light) {
  if (is_round(shape)) return round_pdf_w(shape, point, direction, cos_light);
  const float cosine = shape_two_sided(shape) ? abs(cos_light) : cos_light;
  if (!(cosine > 0)) return 0;
  if (shape_is_near(shape, point)) return near_planar_pdf_w(shape, point, distance, cosine);
  return accept_pdf(distance * distance / (cosine * shape.area));
}

#endif
