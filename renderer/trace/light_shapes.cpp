#include "renderer/trace/light_shapes.h"

#include "renderer/trace/solid_angle_sampling.h"

namespace helio {
namespace {

// Solid angle sampling is used closer to the centre than this many times the largest extent of the light. Chosen by
// the product of variance and time of unoccluded irradiance estimates (see tests/unit/trace/light_shapes_test.cpp).
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

}  // namespace detail
}  // namespace helio
