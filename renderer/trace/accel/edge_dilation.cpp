#include "renderer/trace/accel/edge_dilation.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

namespace helio {
namespace {

constexpr std::size_t kGrain = 16384;
// Height of a triangle is at most three times the radius of its incircle.
constexpr double kThinnest = 0.125;

struct Incircle {
  V3d center;
  double radius = 0;
  double area = 0;
};

Incircle find_incircle(const V3d& a, const V3d& b, const V3d& c) {
  const double opposite_a = length(c - b), opposite_b = length(a - c), opposite_c = length(b - a);
  const double perimeter = opposite_a + opposite_b + opposite_c;
  Incircle circle;
  circle.area = 0.5 * length(cross(b - a, c - a));
  if (!(perimeter > 0)) return circle;
  circle.center = (a * opposite_a + b * opposite_b + c * opposite_c) / perimeter;
  circle.radius = 2 * circle.area / perimeter;
  return circle;
}

// The factor by which a triangle grows.
double growth(const Incircle& circle, double margin) {
  return circle.radius > kThinnest * margin ? 1 + margin / circle.radius : 1;
}

const V3f& corner_of(const TriangleMesh& mesh, std::size_t triangle, std::size_t k) {
  return mesh.positions[mesh.indices[3 * triangle + k]];
}

struct Areas {
  double before = 0, added = 0;
};

}  // namespace

void widen_triangle(V3f (&corners)[3], double margin) {
  const V3d a(corners[0]), b(corners[1]), c(corners[2]);
  const Incircle circle = find_incircle(a, b, c);
  const double factor = growth(circle, margin);
  if (!(factor > 1)) return;
  corners[0] = V3f(circle.center + (a - circle.center) * factor);
  corners[1] = V3f(circle.center + (b - circle.center) * factor);
  corners[2] = V3f(circle.center + (c - circle.center) * factor);
}

double edge_dilation_share(const TriangleMesh& mesh, double margin) {
  const Areas sum = tbb::parallel_deterministic_reduce(
      tbb::blocked_range<std::size_t>(0, mesh.triangle_count(), kGrain), Areas(),
      [&](const tbb::blocked_range<std::size_t>& range, Areas areas) {
        for (std::size_t t = range.begin(); t < range.end(); ++t) {
          const Incircle circle =
              find_incircle(V3d(corner_of(mesh, t, 0)), V3d(corner_of(mesh, t, 1)), V3d(corner_of(mesh, t, 2)));
          const double factor = growth(circle, margin);
          areas.before += circle.area;
          areas.added += circle.area * (factor * factor - 1);
        }
        return areas;
      },
      [](const Areas& a, const Areas& b) {
        return Areas{a.before + b.before, a.added + b.added};
      });
  return sum.before > 0 ? sum.added / sum.before : 0;
}

void put_longest_side_last(TriangleMesh& mesh) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.triangle_count(), kGrain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t t = range.begin(); t < range.end(); ++t) {
                        const V3f a = corner_of(mesh, t, 0), b = corner_of(mesh, t, 1), c = corner_of(mesh, t, 2);
                        const float opposite[3] = {length_squared(c - b), length_squared(a - c), length_squared(b - a)};
                        std::uint32_t* i = &mesh.indices[3 * t];
                        std::rotate(i, i + (std::max_element(opposite, opposite + 3) - opposite), i + 3);
                      }
                    });
}

}  // namespace helio
