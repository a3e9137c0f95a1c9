#include "renderer/trace/lights/light_shapes.h"

#include "renderer/trace/lights/ellipsoid_area.h"
#include "renderer/trace/sampling/solid_angle_sampling.h"

namespace helio {
namespace {

// Solid angle sampling is used closer to the centre than this many times the largest extent of the light. Chosen by
// the product of variance and time of unoccluded irradiance estimates (see tests/unit/trace/lights/light_shapes_test.cpp).
constexpr float kNearRectangle = 1.0f;
constexpr float kNearTriangle = 0.7f;

// Largest cosine between the edges of a parallelogram that is treated as a rectangle: it shears the map by as much.
constexpr float kRectangleTolerance = 1e-5f;

AreaShape make_planar(ShapeKind kind, const V3f& p0, const V3f& e1, const V3f& e2, const V3f& normal, bool two_sided) {
  AreaShape shape;
  shape.kind = kind;
  shape.p0 = p0;
  shape.e1 = e1;
  shape.e2 = e2;
  shape.normal = normal;
  shape.two_sided = two_sided;
  const bool triangle = kind == ShapeKind::triangle;
  shape.center = p0 + (e1 + e2) * (triangle ? 1.0f / 3 : 0.5f);
  const double area = length(cross(V3d(e1), V3d(e2))) * (triangle ? 0.5 : 1.0);
  const double longest = std::max({length_squared(V3d(e1)), length_squared(V3d(e2)), length_squared(V3d(e1 - e2))});
  // A needle whose area is rounding noise of its edges has no usable normal.
  const bool usable =
      std::isfinite(area) && area < 1e18 && area > 1e-18 && area > 1e-7 * longest && is_finite(p0) && is_finite(normal);
  shape.area = usable ? float(area) : 0.0f;
  return shape;
}

// The sample along a known direction: distance and (s, t) by intersecting the plane.
ShapeSample sample_along(const AreaShape& shape, const V3f& point, const V3f& direction, float solid_angle) {
  ShapeSample sample;
  const float cosine = dot(shape.normal, direction);
  const float facing = shape.two_sided ? std::abs(cosine) : -cosine;
  const V3f d = shape.p0 - point;
  const float distance = dot(shape.normal, d) / cosine;
  if (!(facing > 0) || !(distance > 0)) return sample;
  const V3f in_plane = direction * distance - d, n = cross(shape.e1, shape.e2);
  const float inverse = 1 / length_squared(n);
  sample.st.x = std::clamp(dot(cross(in_plane, shape.e2), n) * inverse, 0.0f, 1.0f);
  sample.st.y = std::clamp(dot(cross(shape.e1, in_plane), n) * inverse, 0.0f, 1.0f - sample.st.x);
  sample.direction = direction;
  sample.distance = distance;
  sample.cos_light = facing;
  sample.pdf_w = 1 / solid_angle;
  return sample;
}

}  // namespace

AreaShape make_triangle_shape(const V3f& p0, const V3f& e1, const V3f& e2, const V3f& normal, bool two_sided) {
  AreaShape shape = make_planar(ShapeKind::triangle, p0, e1, e2, normal, two_sided);
  const float extent = std::max({length_squared(e1), length_squared(e2), length_squared(e1 - e2)});
  shape.near_squared = sqr(kNearTriangle) * extent;
  return shape;
}

AreaShape make_parallelogram_shape(const V3f& p0, const V3f& e1, const V3f& e2, const V3f& normal, bool two_sided) {
  AreaShape shape = make_planar(ShapeKind::parallelogram, p0, e1, e2, normal, two_sided);
  const float l1 = length(e1), l2 = length(e2);
  const bool rectangle = std::abs(dot(e1, e2)) <= kRectangleTolerance * l1 * l2;
  shape.near_squared = rectangle ? sqr(kNearRectangle * std::max(l1, l2)) : 0.0f;
  return shape;
}

AreaShape make_sphere_shape(const V3f& center, float radius, bool two_sided) {
  AreaShape shape;
  shape.kind = ShapeKind::sphere;
  shape.p0 = shape.center = center;
  shape.radius = radius;
  shape.two_sided = two_sided;
  const double area = 4 * std::numbers::pi * double(radius) * radius;
  const bool usable = radius > 0 && area > 1e-18 && area < 1e18 && is_finite(center);
  shape.area = usable ? float(area) : 0.0f;
  return shape;
}

AreaShape make_ellipsoid_shape(const V3f& center, const V3f& e1, const V3f& e2, const V3f& e3, bool two_sided) {
  AreaShape shape;
  shape.kind = ShapeKind::ellipsoid;
  shape.p0 = shape.center = center;
  shape.e1 = e1;
  shape.e2 = e2;
  shape.e3 = e3;
  shape.two_sided = two_sided;
  const double volume = std::abs(dot(V3d(e1), cross(V3d(e2), V3d(e3))));
  const double box = length(V3d(e1)) * length(V3d(e2)) * length(V3d(e3));
  if (!std::isfinite(box) || !(box > 0) || !(volume > 1e-6 * box) || !is_finite(center)) return shape;
  const auto [area, stretch] = ellipsoid_area(V3d(e1), V3d(e2), V3d(e3));
  shape.max_stretch = float(stretch * (1 + 1e-5));  // area_stretch() rounds in float
  shape.area = area > 1e-18 && area < 1e18 ? float(area) : 0.0f;
  return shape;
}

namespace {

// What an ellipsoid's map does, and its inverse. Rows of the inverse are cofactors over the determinant.
struct LinearMap {
  explicit LinearMap(const AreaShape& shape)
      : e1(shape.e1), e2(shape.e2), e3(shape.e3), c1(cross(e2, e3)), c2(cross(e3, e1)), c3(cross(e1, e2)) {
    determinant = dot(e1, c1);
  }
  V3f apply(const V3f& v) const { return e1 * v.x + e2 * v.y + e3 * v.z; }
  V3f invert(const V3f& v) const { return V3f(dot(c1, v), dot(c2, v), dot(c3, v)) * (1 / determinant); }
  V3f cofactors(const V3f& v) const { return c1 * v.x + c2 * v.y + c3 * v.z; }

  V3f e1, e2, e3, c1, c2, c3;
  float determinant;
};

// The unit sphere seen from where `point` lies in its space.
AreaShape unit_sphere(bool two_sided) {
  AreaShape sphere;
  sphere.kind = ShapeKind::sphere;
  sphere.radius = 1;
  sphere.area = 4 * kPi;
  sphere.two_sided = two_sided;
  return sphere;
}

}  // namespace

V3f local_direction(const AreaShape& shape, const V3f& surface_point) {
  const V3f from_center = surface_point - shape.center;
  return shape.kind == ShapeKind::ellipsoid ? LinearMap(shape).invert(from_center) : from_center;
}

// |det A| |A^-T n|: the normal of an area element maps by the cofactors.
float area_stretch(const AreaShape& ellipsoid, const V3f& local) {
  return length(LinearMap(ellipsoid).cofactors(local));
}

V3f ellipsoid_normal(const AreaShape& ellipsoid, const V3f& local) {
  const LinearMap map(ellipsoid);
  return normalize_any(map.cofactors(local) * std::copysign(1.0f, map.determinant));
}

namespace detail {

ShapeSample sample_near_planar(const AreaShape& shape, const V3f& point, const V2f& u) {
  const float height = dot(shape.normal, point - shape.p0);
  if (!shape.two_sided && !(height > 0)) return {};
  if (shape.kind == ShapeKind::triangle) {
    const SphericalTriangle triangle(point, shape.p0, shape.e1, shape.e2);
    if (!(triangle.solid_angle() >= kMinSolidAngle)) return sample_planar_area(shape, point, square_to_triangle(u));
    return sample_along(shape, point, triangle.sample(u), triangle.solid_angle());
  }
  const SphericalRectangle rectangle(point, shape.p0, shape.e1, shape.e2);
  if (!(rectangle.solid_angle() >= kMinSolidAngle)) return sample_planar_area(shape, point, u);
  ShapeSample sample = sample_planar_area(shape, point, rectangle.sample(u));
  if (sample.pdf_w > 0) sample.pdf_w = 1 / rectangle.solid_angle();
  return sample;
}

float pdf_w_near_planar(const AreaShape& shape, const V3f& point, float distance, float cosine) {
  const float solid_angle = shape.kind == ShapeKind::triangle
                                ? SphericalTriangle(point, shape.p0, shape.e1, shape.e2).solid_angle()
                                : SphericalRectangle(point, shape.p0, shape.e1, shape.e2).solid_angle();
  if (solid_angle >= kMinSolidAngle) return 1 / solid_angle;
  return accept_pdf(distance * distance / (cosine * shape.area));
}

// From outside, uniform over the cone that the sphere fills: 1 - cos of its half angle is taken from the sine, so that
// it keeps its digits for small and far spheres. From inside, uniform over all directions.
ShapeSample sample_sphere(const AreaShape& shape, const V3f& point, const V2f& u) {
  ShapeSample sample;
  const V3f to_center = shape.center - point;
  const float squared = length_squared(to_center), radius_squared = sqr(shape.radius);
  const float phi = kTwoPi * u.y;
  if (!(squared > radius_squared)) {
    if (!shape.two_sided) return sample;
    const float z = 1 - 2 * u.x, r = safe_sqrt(1 - z * z);
    sample.direction = V3f(r * std::cos(phi), r * std::sin(phi), z);
    const float along = dot(sample.direction, to_center), depth = radius_squared - squared;
    const float root = std::sqrt(along * along + depth);
    sample.distance = along > 0 ? along + root : depth / (root - along);
    sample.cos_light = root / shape.radius;
    sample.pdf_w = sample.distance > 0 ? kInvPi / 4 : 0.0f;
    return sample;
  }
  const float distance = std::sqrt(squared), sine_squared = radius_squared / squared;
  const float cap = sine_squared / (1 + safe_sqrt(1 - sine_squared));  // 1 - cos of the cone's half angle
  const float below = u.x * cap;                                       // 1 - cos of the sampled angle
  const float sine = std::sqrt(below * (2 - below));
  const Frame frame(to_center * (1 / distance));
  sample.direction = frame.to_world(V3f(sine * std::cos(phi), sine * std::sin(phi), 1 - below));
  const float root = safe_sqrt(radius_squared - squared * sqr(sine));
  sample.distance = distance * (1 - below) - root;
  sample.cos_light = root / shape.radius;
  sample.pdf_w = sample.distance > 0 ? accept_pdf(kInvPi / (2 * cap)) : 0.0f;
  return sample;
}

float pdf_w_sphere(const AreaShape& shape, const V3f& point, float cos_light) {
  const float squared = length_squared(shape.center - point), radius_squared = sqr(shape.radius);
  if (!(squared > radius_squared)) return shape.two_sided && cos_light < 0 ? kInvPi / 4 : 0.0f;
  if (!(cos_light > 0)) return 0;  // the far side, seen through an opening: never sampled
  const float sine_squared = radius_squared / squared;
  const float cap = sine_squared / (1 + safe_sqrt(1 - sine_squared));
  return accept_pdf(kInvPi / (2 * cap));
}

// Rays from a point to an ellipsoid are, under the inverse of the map A that makes it from the unit sphere, rays to
// that sphere; so its directions are sampled there and carried over. A takes the solid angle dw' around the unit
// direction w' to |det A| / |A w'|^3 dw' (the volume t^2 dt dw' grows by |det A|, lengths along the ray by |A w'|).
ShapeSample sample_ellipsoid(const AreaShape& shape, const V3f& point, const V2f& u) {
  const LinearMap map(shape);
  const V3f local_point = map.invert(point - shape.center);
  ShapeSample sample = sample_sphere(unit_sphere(shape.two_sided), local_point, u);
  if (!(sample.pdf_w > 0)) return {};
  const V3f normal = map.cofactors(local_point + sample.direction * sample.distance);
  const V3f direction = map.apply(sample.direction);
  const float stretch = length(direction);
  sample.direction = direction * (1 / stretch);
  sample.distance *= stretch;
  sample.cos_light = std::abs(dot(normalize(normal), sample.direction));
  sample.pdf_w = accept_pdf(sample.pdf_w * stretch * stretch * stretch / std::abs(map.determinant));
  return sample;
}

float pdf_w_ellipsoid(const AreaShape& shape, const V3f& point, const V3f& direction, float cos_light) {
  const LinearMap map(shape);
  const float pdf_w = pdf_w_sphere(unit_sphere(shape.two_sided), map.invert(point - shape.center), cos_light);
  const float stretch = 1 / length(map.invert(direction));  // |A w'| of the unit w' along A^-1 w
  return accept_pdf(pdf_w * stretch * stretch * stretch / std::abs(map.determinant));
}

}  // namespace detail
}  // namespace helio
