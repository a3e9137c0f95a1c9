#include "renderer/scene/gltf/skin.h"

#include <algorithm>

namespace helio::gltf {

namespace {

double determinant3(const M44d& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

V3f unit_or(const V3d& v, const V3f& fallback) {
  const double length = helio::length(v);
  return length > 1e-30 ? V3f(v / length) : fallback;
}

// Rounding gives joints that press flat a determinant of either sign.
bool is_mirrored(const M44d& m) {
  double volume = 1;
  for (int i = 0; i < 3; ++i) volume *= length(V3d(m[i][0], m[i][1], m[i][2]));
  return determinant3(m) < -1e-12 * volume;
}

double largest_cofactor(const M44d& m) {
  const V3d x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]), z(m[2][0], m[2][1], m[2][2]);
  return std::max({length(cross(y, z)), length(cross(z, x)), length(cross(x, y))});
}

void take_normals_of_triangles(const std::vector<std::uint32_t>& vertices, TriangleMesh& mesh) {
  std::vector<V3d> sums(mesh.positions.size(), V3d(0));
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::uint32_t* t = &mesh.indices[i];
    const V3d a(mesh.positions[t[0]]);
    const V3d area = cross(V3d(mesh.positions[t[1]]) - a, V3d(mesh.positions[t[2]]) - a);
    for (int c = 0; c < 3; ++c) sums[t[c]] += area;
  }
  for (const std::uint32_t v : vertices) mesh.normals[v] = unit_or(sums[v], mesh.normals[v]);
}

// Normal matrix times determinant: no division, and right for flattened joints too. Rows are cross products.
V3d transform_normal(const M44d& m, const V3d& n) {
  const V3d x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]), z(m[2][0], m[2][1], m[2][2]);
  return cross(y, z) * n.x + cross(z, x) * n.y + cross(x, y) * n.z;
}

V3d transform_vector(const M44d& m, const V3d& v) {
  return {v.x * m[0][0] + v.y * m[1][0] + v.z * m[2][0], v.x * m[0][1] + v.y * m[1][1] + v.z * m[2][1],
          v.x * m[0][2] + v.y * m[1][2] + v.z * m[2][2]};
}

}  // namespace

bool joint_matrices(const Skin& skin, const std::vector<M44d>& to_world, AccessorReader& reader,
                    std::vector<M44d>& joints) {
  std::vector<std::array<float, 16>> inverse_bind;
  if (skin.inverse_bind_matrices >= 0 && !reader.read_matrices(skin.inverse_bind_matrices, inverse_bind)) return false;
  joints.resize(skin.joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    M44d bind;
    if (!inverse_bind.empty())
      for (int i = 0; i < 16; ++i) bind[i / 4][i % 4] = inverse_bind[j][std::size_t(i)];
    joints[j] = bind * to_world[std::size_t(skin.joints[j])];
  }
  reader.budget().release(inverse_bind.size() * sizeof(std::array<float, 16>));
  return true;
}

void apply_skin(const std::vector<M44d>& joints, const V3d& origin, PrimitiveGeometry& geometry) {
  TriangleMesh& mesh = geometry.mesh;
  const SkinBinding& skin = geometry.skin;
  std::vector<bool> mirrored(mesh.positions.size());
  std::vector<std::uint32_t> lost;  // vertices whose normal vanishes
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    M44d blend(0.0);
    double total = 0;
    for (std::size_t i = v * skin.per_vertex; i < (v + 1) * skin.per_vertex; ++i) {
      if (skin.weights[i] == 0) continue;
      total += double(skin.weights[i]);
      blend += joints[skin.joints[i]] * double(skin.weights[i]);
    }
    if (total == 0) blend.makeIdentity();
    V3d p = transform_vector(blend, V3d(mesh.positions[v])) + V3d(blend[3][0], blend[3][1], blend[3][2]);
    mesh.positions[v] = V3f(p - origin);
    mirrored[v] = is_mirrored(blend);
    if (!mesh.normals.empty()) {
      const V3d normal = transform_normal(blend, V3d(mesh.normals[v])) * (mirrored[v] ? -1.0 : 1.0);
      if (!(length(normal) > 1e-9 * largest_cofactor(blend))) lost.push_back(std::uint32_t(v));
      mesh.normals[v] = unit_or(normal, mesh.normals[v]);
    }
    if (!mesh.tangents.empty()) {
      V4f& tangent = mesh.tangents[v];
      const V3f t(tangent.x, tangent.y, tangent.z);
      const V3f moved = unit_or(transform_vector(blend, V3d(t)), t);
      tangent = V4f(moved.x, moved.y, moved.z, tangent.w);
    }
  }
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
    if (mirrored[mesh.indices[i]]) std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  if (!lost.empty()) take_normals_of_triangles(lost, mesh);
}

}  // namespace helio::gltf
