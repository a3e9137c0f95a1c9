#include "renderer/scene/mitsuba_primitives.h"

#include <cmath>

namespace helio::mitsuba {

namespace {

void add_quad(TriangleMesh& mesh, const V3f& a, const V3f& b, const V3f& c, const V3f& d) {
  const std::uint32_t first = std::uint32_t(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c, d});
  mesh.texcoords[0].insert(mesh.texcoords[0].end(), {V2f(0, 0), V2f(1, 0), V2f(1, 1), V2f(0, 1)});
  mesh.indices.insert(mesh.indices.end(), {first, first + 1, first + 2, first, first + 2, first + 3});
}

// Cosine and sine of i turns / kSegments; the last equals the first exactly.
Imath::V2d on_circle(int i) {
  const double angle = 2 * std::numbers::pi * (i % kSegments) / kSegments;
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

TriangleMesh disk_mesh() {
  TriangleMesh mesh;
  for (int i = 0; i < kSegments; ++i) {
    const Imath::V2d a = on_circle(i), b = on_circle(i + 1);
    const std::uint32_t first = std::uint32_t(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(),
                          {V3f(0, 0, 0), V3f(float(a.x), float(a.y), 0), V3f(float(b.x), float(b.y), 0)});
    const float from = float(i) / kSegments, to = float(i + 1) / kSegments;
    mesh.texcoords[0].insert(mesh.texcoords[0].end(), {V2f(0, 0.5f * (from + to)), V2f(1, from), V2f(1, to)});
    mesh.indices.insert(mesh.indices.end(), {first, first + 1, first + 2});
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

void flip(TriangleMesh& mesh) {
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  for (V3f& n : mesh.normals) n = -n;
}

void add_u_tangents(TriangleMesh& mesh) {
  const std::vector<V2f>& uvs = mesh.texcoords[0];
  if (uvs.empty()) return;
  std::vector<V3f> sums(mesh.positions.size(), V3f(0, 0, 0));
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::uint32_t *k = &mesh.indices[i], a = k[0], b = k[1], c = k[2];
    const V2f d1 = uvs[b] - uvs[a], d2 = uvs[c] - uvs[a];
    const float determinant = d1.x * d2.y - d1.y * d2.x;
    if (!(std::fabs(determinant) > 1e-20f)) continue;
    const V3f e1 = mesh.positions[b] - mesh.positions[a], e2 = mesh.positions[c] - mesh.positions[a];
    const V3f along = normalize_any((e1 * d2.y - e2 * d1.y) * (1 / determinant));
    for (const std::uint32_t vertex : {a, b, c}) sums[vertex] += along;
  }
  mesh.tangents.clear();
  for (const V3f& sum : sums) {
    const V3f unit = normalize_any(sum);
    const V3f safe = length_squared(unit) > 0.5f ? unit : V3f(1, 0, 0);
    mesh.tangents.push_back({safe.x, safe.y, safe.z, 1});
  }
}

}  // namespace helio::mitsuba
