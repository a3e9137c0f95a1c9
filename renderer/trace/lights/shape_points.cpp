#include "renderer/trace/lights/shape_points.h"

#include <bit>

#include "renderer/trace/sampling/sampler.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {
namespace {

// At least every second draw is kept: running out of them has a probability of 2^-63.
constexpr int kMaxDraws = 64;

V3f uniform_by_area(const AreaShape& ellipsoid, const V2f& u) {
  std::uint32_t state = combine_hash(std::bit_cast<std::uint32_t>(u.x), std::bit_cast<std::uint32_t>(u.y));
  const auto next = [&state] { return unit_float(state = hash32(state + 0x9e3779b9u)); };
  V3f local = square_to_sphere(u);
  for (int draw = 1; draw < kMaxDraws; ++draw) {
    if (next() * ellipsoid.max_stretch < area_stretch(ellipsoid, local)) break;
    const float x = next();
    local = square_to_sphere({x, next()});
  }
  return local;
}

}  // namespace

ShapePoint sample_shape_point(const AreaShape& shape, const V2f& u) {
  ShapePoint point;
  if (shape.kind == ShapeKind::sphere) {
    point.local = point.normal = square_to_sphere(u);
    point.position = shape.center + point.normal * shape.radius;
    return point;
  }
  if (shape.kind == ShapeKind::ellipsoid) {
    point.local = uniform_by_area(shape, u);
    point.normal = ellipsoid_normal(shape, point.local);
    point.position = shape.center + shape.e1 * point.local.x + shape.e2 * point.local.y + shape.e3 * point.local.z;
    return point;
  }
  point.st = shape.kind == ShapeKind::triangle ? square_to_triangle(u) : u;
  point.normal = shape.normal;
  point.position = shape.p0 + shape.e1 * point.st.x + shape.e2 * point.st.y;
  return point;
}

}  // namespace helio
