// The shapes that area lights have, as plain records: sample a direction to one, and the density of a direction found
// otherwise. Far from a planar light its area is sampled; near it, where d^2 / cos would make the estimate noisy,
// its solid angle. Spheres: the cone they fill from outside, all directions from inside; ellipsoids: the image of that.
//
// pdf_w_shape() takes the same decisions as sample_shape() from the same point: both agree for any hit.
#pragma once

#include <cstdint>
#include <limits>

#include "renderer/base/math.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {

enum class ShapeKind : std::uint8_t { triangle, parallelogram, sphere, ellipsoid };

// One- and two-sided area light without its radiance. Sphere, ellipsoid: p0 is the centre.
struct AreaShape {
  V3f p0{0, 0, 0}, e1{0, 0, 0}, e2{0, 0, 0};
  V3f e3{0, 0, 0};         // ellipsoid: e1, e2, e3 are what the unit sphere's axes x, y, z become
  V3f normal{0, 0, 1};     // planar: unit, front
  V3f center{0, 0, 0};     // planar: centroid
  float area = 0;          // > 0
  float near_squared = 0;  // planar: closer to the centre than the root of this, sample the solid angle; 0: never
  float radius = 0;        // sphere
  float max_stretch = 0;   // ellipsoid: what area_stretch() does not exceed
  ShapeKind kind = ShapeKind::triangle;
  bool two_sided = false;
};

// Records of shapes; `area` is 0 where the shape is degenerate or not finite and must not be used as a light.
AreaShape make_triangle_shape(const V3f& p0, const V3f& e1, const V3f& e2, const V3f& normal, bool two_sided);
AreaShape make_parallelogram_shape(const V3f& p0, const V3f& e1, const V3f& e2, const V3f& normal, bool two_sided);
AreaShape make_sphere_shape(const V3f& center, float radius, bool two_sided);
// The unit sphere under (x, y, z) -> center + x e1 + y e2 + z e3.
AreaShape make_ellipsoid_shape(const V3f& center, const V3f& e1, const V3f& e2, const V3f& e3, bool two_sided);

// Direction, in the unit sphere's space, of a point of a sphere or ellipsoid: its normal there. Not unit.
V3f local_direction(const AreaShape& shape, const V3f& surface_point);
// Area of an ellipsoid's surface per area of the unit sphere around its unit direction `local`.
float area_stretch(const AreaShape& ellipsoid, const V3f& local);
// Unit, outwards, at the point that the unit direction `local` becomes.
V3f ellipsoid_normal(const AreaShape& ellipsoid, const V3f& local);

struct ShapeSample {
  V3f direction{0, 0, 0};  // unit, from the point to the light
  float distance = 0;
  float pdf_w = 0;      // 0: no sample, the light does not reach the point this way
  float cos_light = 1;  // |cosine| between the direction and the shape's normal where it meets the shape
  V2f st{0, 0};         // planar: the point is p0 + st.x e1 + st.y e2
};

// Densities above this (per steradian) are treated as 0 by both functions, so that none is infinite; they arise within
// rounding of a light's plane only.
inline constexpr float kMaxShapePdf = 1e30f;

namespace detail {

inline float accept_pdf(float pdf) {
  return pdf <= kMaxShapePdf ? pdf : 0.0f;
}  // drops NaN too

// Area sampling of a planar shape at p0 + s e1 + t e2. Without a branch, so that loops over it vectorise.
inline ShapeSample sample_planar_area(const AreaShape& shape, const V3f& point, const V2f& st) {
  ShapeSample sample;
  const V3f to_light = (shape.p0 - point) + shape.e1 * st.x + shape.e2 * st.y;
  const float front = -dot(shape.normal, to_light), other_side = shape.two_sided ? -1.0f : 1.0f;
  const float height = std::max(front, front * other_side);
  const float squared = length_squared(to_light), distance = std::sqrt(squared);
  const float inverse = 1 / distance;
  const float seen = height > 0 ? height : std::numeric_limits<float>::infinity();  // from behind: density 0
  sample.direction = to_light * inverse;
  sample.cos_light = height * inverse;
  sample.distance = distance;
  sample.pdf_w = accept_pdf(squared * distance / (seen * shape.area));
  sample.st = st;
  return sample;
}

// The cases that are not on the hottest path: near planar shapes, spheres, ellipsoids.
ShapeSample sample_near_planar(const AreaShape& shape, const V3f& point, const V2f& u);
ShapeSample sample_sphere(const AreaShape& shape, const V3f& point, const V2f& u);
ShapeSample sample_ellipsoid(const AreaShape& shape, const V3f& point, const V2f& u);
float pdf_w_near_planar(const AreaShape& shape, const V3f& point, float distance, float cosine);
float pdf_w_sphere(const AreaShape& shape, const V3f& point, float cos_light);
float pdf_w_ellipsoid(const AreaShape& shape, const V3f& point, const V3f& direction, float cos_light);

inline bool is_near(const AreaShape& shape, const V3f& point) {
  return length_squared(shape.center - point) < shape.near_squared;
}

}  // namespace detail

// u in [0, 1)^2.
inline ShapeSample sample_shape(const AreaShape& shape, const V3f& point, const V2f& u) {
  if (shape.kind == ShapeKind::sphere) return detail::sample_sphere(shape, point, u);
  if (shape.kind == ShapeKind::ellipsoid) return detail::sample_ellipsoid(shape, point, u);
  if (detail::is_near(shape, point)) [[unlikely]]
    return detail::sample_near_planar(shape, point, u);
  return detail::sample_planar_area(shape, point,
                                    shape.kind == ShapeKind::triangle ? square_to_triangle(u) : u);
}

// Solid angle density of sample_shape() at `point` for the unit direction that hit the shape at `distance`, where the
// cosine between the front normal and the direction back to the point is cos_light.
inline float pdf_w_shape(const AreaShape& shape, const V3f& point, const V3f& direction, float distance,
                         float cos_light) {
  if (shape.kind == ShapeKind::sphere) return detail::pdf_w_sphere(shape, point, cos_light);
  if (shape.kind == ShapeKind::ellipsoid) return detail::pdf_w_ellipsoid(shape, point, direction, cos_light);
  const float cosine = shape.two_sided ? std::abs(cos_light) : cos_light;
  if (!(cosine > 0)) return 0;
  if (detail::is_near(shape, point)) [[unlikely]] {
    return detail::pdf_w_near_planar(shape, point, distance, cosine);
  }
  return detail::accept_pdf(distance * distance / (cosine * shape.area));
}

}  // namespace helio
