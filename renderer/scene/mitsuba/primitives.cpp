#include "renderer/scene/mitsuba/primitives.h"

#include <array>
#include <cmath>

namespace helio::mitsuba {

namespace {

void add_quad(TriangleMesh& mesh, const V3f& a, const V3f& b, const V3f& c, const V3f& d) {
  const std::uint32_t first = std::uint32_t(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c, d});
  mesh.texcoords[0].insert(mesh.texcoords[0].end(), {V2f(0, 0), V2f(1, 0), V2f(1, 1), V2f(0, 1)});
  mesh.indices.insert(mesh.indices.end(), {first, first + 1, first + 2, first, first + 2, first + 3});
}

// Cosine and sine of i turns / segments; the last equals the first exactly.
Imath::V2d on_circle(int i, int segments = kSegments) {
  const double angle = 2 * std::numbers::pi * (i % segments) / segments;
  return {std::cos(angle), std::sin(angle)};
}

}  // namespace

TriangleMesh rectangle_mesh() {
  TriangleMesh mesh;
  add_quad(mesh, {-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
  return mesh;
}

TriangleMesh cube_mesh() {
  TriangleMesh mesh;
  // Around each axis: both others in the order that makes a right-handed frame.
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0f, 1.0f}) {
      V3f n(0, 0, 0), u(0, 0, 0), v(0, 0, 0);
      n[axis] = side;
      u[(axis + 1) % 3] = side;
      v[(axis + 2) % 3] = 1;
      add_quad(mesh, n - u - v, n + u - v, n + u + v, n - u + v);
    }
  }
  return mesh;
}

TriangleMesh disk_mesh(int rings) {
  TriangleMesh mesh;
  const auto add_triangle = [&](const std::array<V3f, 3>& positions, const std::array<V2f, 3>& uvs) {
    const std::uint32_t first = std::uint32_t(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), positions.begin(), positions.end());
    mesh.texcoords[0].insert(mesh.texcoords[0].end(), uvs.begin(), uvs.end());
    mesh.indices.insert(mesh.indices.end(), {first, first + 1, first + 2});
  };
  float inner = 0;
  for (int ring = 0; ring < rings; ++ring) {
    // Each ring is as wide in proportion to its radius: 0.95 of the next, and a full disk in the middle.
    const float outer = std::pow(0.95f, float(rings - 1 - ring));
    for (int i = 0; i < kSegments; ++i) {
      const Imath::V2d a = on_circle(i), b = on_circle(i + 1);
      const float from = float(i) / kSegments, to = float(i + 1) / kSegments;
      const V3f at_a(float(a.x), float(a.y), 0), at_b(float(b.x), float(b.y), 0);
      if (ring == 0) {
        add_triangle({V3f(0, 0, 0), at_a * outer, at_b * outer},
                     {V2f(0, 0.5f * (from + to)), V2f(outer, from), V2f(outer, to)});
        continue;
      }
      add_triangle({at_a * inner, at_a * outer, at_b * outer}, {V2f(inner, from), V2f(outer, from), V2f(outer, to)});
      add_triangle({at_a * inner, at_b * outer, at_b * inner}, {V2f(inner, from), V2f(outer, to), V2f(inner, to)});
    }
    inner = outer;
  }
  return mesh;
}

TriangleMesh cylinder_mesh(const V3d& p0, const V3d& p1, double radius) {
  TriangleMesh mesh;
  const V3d axis = normalize(p1 - p0);
  const Frame frame{V3f(axis)};
  const V3d s(frame.s), t(frame.t);
  for (int i = 0; i <= kSegments; ++i) {
    const Imath::V2d c = on_circle(i);
    const V3d normal = s * c.x + t * c.y;
    for (const V3d& end : {p0, p1}) {
      mesh.positions.push_back(V3f(end + normal * radius));
      mesh.normals.push_back(V3f(normal));
    }
    mesh.texcoords[0].insert(mesh.texcoords[0].end(),
                             {V2f(float(i) / kSegments, 0), V2f(float(i) / kSegments, 1)});
    const std::uint32_t k = std::uint32_t(2 * i);
    if (i < kSegments) mesh.indices.insert(mesh.indices.end(), {k, k + 2, k + 3, k, k + 3, k + 1});
  }
  return mesh;
}

TriangleMesh sphere_mesh(const V3d& center, double radius, int segments) {
  const std::uint32_t columns = std::uint32_t(segments), rows = columns / 2;
  TriangleMesh mesh;
  for (std::uint32_t row = 0; row <= rows; ++row) {
    const Imath::V2d tilt = on_circle(int(row), segments);
    for (std::uint32_t column = 0; column <= columns; ++column) {
      const Imath::V2d turn = on_circle(int(column), segments);
      const V3d normal(turn.x * tilt.y, turn.y * tilt.y, tilt.x);
      mesh.positions.push_back(V3f(center + normal * radius));
      mesh.normals.push_back(V3f(normal));
      mesh.texcoords[0].emplace_back(float(column) / float(columns), float(row) / float(rows));
      if (row == rows || column == columns) continue;
      const std::uint32_t k = row * (columns + 1) + column, below = k + columns + 1;
      // At the poles one of the two has no area.
      if (row > 0) mesh.indices.insert(mesh.indices.end(), {k, below + 1, k + 1});
      if (row + 1 < rows) mesh.indices.insert(mesh.indices.end(), {k, below, below + 1});
    }
  }
  return mesh;
}

void flip(TriangleMesh& mesh) {
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  for (V3f& n : mesh.normals) n = -n;
}

}  // namespace helio::mitsuba
