#include "renderer/scene/mitsuba/meshes.h"

#include <algorithm>
#include <cmath>

namespace helio::mitsuba {

namespace {

// At the most.
constexpr std::uint64_t kVertexBytes = sizeof(V3f) * 2 + sizeof(V2f) + sizeof(V4f);

Status check_colors(const std::vector<V4f>& colors, const char* of_what) {
  for (std::size_t i = 0; i < colors.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (!(colors[i][c] >= 0 && colors[i][c] <= 1))
        return Error{ErrorCode::invalid_argument,
                     std::string(of_what) + " " + std::to_string(i) + " has the colour value " +
                         std::to_string(colors[i][c]) + ", allowed: [0, 1]",
                     ""};
  return ok_status();
}

template <class T>
void spread(std::vector<T>& values, const std::vector<std::uint32_t>& indices) {
  if (values.empty()) return;
  std::vector<T> of_corners;
  of_corners.reserve(indices.size());
  for (const std::uint32_t i : indices) of_corners.push_back(values[i]);
  values = std::move(of_corners);
}

template <class T>
void repeat(std::vector<T>& values, std::size_t i) {
  if (!values.empty()) values.push_back(T(values[i]));
}

const V3f kAnyNormal(0, 0, 1);  // of what has no area

// Corners whose normal is 0.
Status give_face_normals(TriangleMesh& mesh, MemoryBudget& budget) {
  const auto lacks = [&](std::uint32_t vertex) { return mesh.normals[vertex] == V3f(0, 0, 0); };
  const auto corners = std::count_if(mesh.indices.begin(), mesh.indices.end(), lacks);
  if (Status s = budget.reserve(std::uint64_t(corners), kVertexBytes, ""); !s.ok()) return s;
  for (std::size_t t = 0; corners > 0 && t + 2 < mesh.indices.size(); t += 3) {
    std::uint32_t* i = &mesh.indices[t];
    const V3d p(mesh.positions[i[0]]);
    const V3d normal = cross(V3d(mesh.positions[i[1]]) - p, V3d(mesh.positions[i[2]]) - p);
    for (int k = 0; k < 3; ++k) {
      if (!lacks(i[k])) continue;
      repeat(mesh.positions, i[k]);
      repeat(mesh.texcoords[0], i[k]);
      repeat(mesh.colors, i[k]);
      mesh.normals.push_back(length(normal) > 0 ? V3f(normalize(normal)) : kAnyNormal);
      i[k] = std::uint32_t(mesh.positions.size() - 1);
    }
  }
  // Nothing names the others any more.
  std::replace(mesh.normals.begin(), mesh.normals.end(), V3f(0, 0, 0), kAnyNormal);
  return ok_status();
}

}  // namespace

Status check_mesh(TriangleMesh& mesh, MemoryBudget& budget) {
  const std::size_t n = mesh.positions.size();
  for (std::size_t i = 0; i < mesh.indices.size(); ++i)
    if (mesh.indices[i] >= n)
      return Error{ErrorCode::invalid_argument,
                   "triangle " + std::to_string(i / 3) + " names vertex " + std::to_string(mesh.indices[i]) +
                       " of " + std::to_string(n),
                   ""};
  for (std::size_t i = 0; i < n; ++i)
    if (!is_finite(mesh.positions[i]))
      return Error{ErrorCode::invalid_argument, "vertex " + std::to_string(i) + " is not finite", ""};
  if (mesh.normals.size() != n) mesh.normals.clear();
  for (V3f& normal : mesh.normals) {
    const V3f unit = is_finite(normal) ? normalize_any(normal) : V3f(0, 0, 0);
    normal = length_squared(unit) > 0.5f ? unit : V3f(0, 0, 0);
  }
  if (mesh.colors.size() != n) mesh.colors.clear();
  if (Status s = check_colors(mesh.colors, "vertex"); !s.ok()) return s;
  std::vector<V2f>& uvs = mesh.texcoords[0];
  if (uvs.size() != n) uvs.clear();
  for (V2f& uv : uvs)
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) uv = V2f(0, 0);
  return mesh.normals.empty() ? ok_status() : give_face_normals(mesh, budget);
}

Status color_faces(TriangleMesh& mesh, const std::vector<V4f>& colors, MemoryBudget& budget) {
  if (const std::size_t triangles = mesh.indices.size() / 3; colors.size() != triangles) {
    return Error{ErrorCode::invalid_argument,
                 "has colours for " + std::to_string(colors.size()) + " of its " + std::to_string(triangles) +
                     " triangles; allowed: for all of them",
                 ""};
  }
  if (Status s = check_colors(colors, "triangle"); !s.ok()) return s;
  if (Status s = budget.reserve(mesh.indices.size(), kVertexBytes, ""); !s.ok()) return s;
  spread(mesh.positions, mesh.indices);
  spread(mesh.normals, mesh.indices);
  spread(mesh.texcoords[0], mesh.indices);
  mesh.colors.clear();
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    mesh.colors.push_back(colors[i / 3]);
    mesh.indices[i] = std::uint32_t(i);
  }
  return ok_status();
}

void add_vertex_normals(TriangleMesh& mesh) {
  std::vector<V3d> sums(mesh.positions.size(), V3d(0, 0, 0));
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
    const std::uint32_t* i = &mesh.indices[t];
    const V3d p[3] = {V3d(mesh.positions[i[0]]), V3d(mesh.positions[i[1]]), V3d(mesh.positions[i[2]])};
    const V3d normal = cross(p[1] - p[0], p[2] - p[0]);
    if (!(length(normal) > 0)) continue;
    const V3d unit = normalize(normal);
    for (int k = 0; k < 3; ++k) {
      const V3d a = p[(k + 1) % 3] - p[k], b = p[(k + 2) % 3] - p[k];
      sums[i[k]] += unit * std::atan2(length(cross(a, b)), dot(a, b));
    }
  }
  mesh.normals.clear();
  for (const V3d& sum : sums) mesh.normals.push_back(length(sum) > 0 ? V3f(normalize(sum)) : kAnyNormal);
}

}  // namespace helio::mitsuba
