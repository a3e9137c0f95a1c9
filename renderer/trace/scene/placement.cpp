#include "renderer/trace/scene/placement.h"

#include "renderer/base/camera_limits.h"
#include "renderer/trace/scene/scene_data.h"
#include "renderer/trace/scene/surface.h"

namespace helio {
namespace {

// Extent of the scene in the space of an instanced object: far enough below what can be traced to leave cameras room.
constexpr double kMaxObjectReach = 1e17;

bool in_range(const Box3d& box) {
  return box.isEmpty() || (in_coordinate_range(box.min) && in_coordinate_range(box.max));
}

}  // namespace

Linear::Linear(const InstanceRecord& record)
    : x(record.to_world[0], record.to_world[1], record.to_world[2]),
      y(record.to_world[3], record.to_world[4], record.to_world[5]),
      z(record.to_world[6], record.to_world[7], record.to_world[8]) {}

Linear Linear::normal_transform() const {
  Linear r = *this;
  const double sign = determinant() < 0 ? -1 : 1;
  r.x = cross(y, z) * sign;
  r.y = cross(z, x) * sign;
  r.z = cross(x, y) * sign;
  return r;
}

double Linear::uniform_scale() const {
  const double a = length(x), b = length(y), c = length(z), tolerance = 1e-6 * a;
  const bool equal = std::abs(a - b) <= tolerance && std::abs(a - c) <= tolerance;
  const bool orthogonal = std::abs(dot(x, y)) <= tolerance * a && std::abs(dot(x, z)) <= tolerance * a &&
                          std::abs(dot(y, z)) <= tolerance * a;
  return equal && orthogonal ? a : 0;
}

bool turns(const Linear& l) {
  const double tolerance = 1e-9 * (length(l.x) + length(l.y) + length(l.z));
  const auto off = [&](double a, double b) { return std::abs(a) > tolerance || std::abs(b) > tolerance; };
  return off(l.x.y, l.x.z) || off(l.y.x, l.y.z) || off(l.z.x, l.z.y) || l.x.x < 0 || l.y.y < 0 || l.z.z < 0;
}

V3d transform_point(const M44d& m, const V3d& p) {
  return {p.x * m[0][0] + p.y * m[1][0] + p.z * m[2][0] + m[3][0],
          p.x * m[0][1] + p.y * m[1][1] + p.z * m[2][1] + m[3][1],
          p.x * m[0][2] + p.y * m[1][2] + p.z * m[2][2] + m[3][2]};
}

bool is_usable_transform(const M44d& m) {
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (!std::isfinite(m[i][j])) return false;
    }
  }
  const Linear linear(m);
  const double volume = length(linear.x) * length(linear.y) * length(linear.z);
  return volume > 0 && std::abs(linear.determinant()) > 1e-12 * volume;
}

namespace {

// True when some triangle or sphere has an area once a transform onto a plane has moved it.
bool leaves_area(const Object& object, const Linear& linear) {
  if (!object.spheres.empty()) return true;
  for (const TriangleMesh& mesh : object.meshes) {
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const V3f& p = mesh.positions[mesh.indices[i]];
      const V3d a = linear.apply(mesh.positions[mesh.indices[i + 1]] - p);
      const V3d b = linear.apply(mesh.positions[mesh.indices[i + 2]] - p);
      if (length(cross(a, b)) > 1e-9 * length(a) * length(b)) return true;
    }
  }
  return false;
}

}  // namespace

std::optional<M44d> with_thickness(const M44d& m, const Object& object, const V3d& centre, bool mirrored) {
  // A share of the smaller side left. Embree finds spheres less exactly than triangles in a space stretched so much.
  const double thickness = object.spheres.empty() ? 1e-6 : 1e-4;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (!std::isfinite(m[i][j])) return std::nullopt;
    }
  }
  const Linear linear(m);
  const V3d cofactors[3] = {cross(linear.y, linear.z), cross(linear.z, linear.x), cross(linear.x, linear.y)};
  // In a matrix of rank two all are multiples of the plane's normal; the multiples are the direction that vanishes.
  V3d normal = cofactors[0];
  for (const V3d& c : cofactors)
    if (length(c) > length(normal)) normal = c;
  const double size = std::max({length(linear.x), length(linear.y), length(linear.z)});
  if (!(length(normal) > 1e-12 * size * size) || !leaves_area(object, linear)) return std::nullopt;
  normal = normal / length(normal);
  V3d vanishing(dot(cofactors[0], normal), dot(cofactors[1], normal), dot(cofactors[2], normal));
  const double area = length(vanishing);
  vanishing = vanishing / area;
  // The determinant becomes area times the added length.
  const double added = thickness * area / size * (mirrored ? -1 : 1);
  M44d thick = m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      thick[i][j] += added * vanishing[i] * normal[j];
      thick[3][j] -= added * vanishing[i] * centre[i] * normal[j];
    }
  }
  if (!is_usable_transform(thick)) return std::nullopt;
  return thick;
}

Box3d object_box(const Object& object) {
  Box3d box;
  for (const TriangleMesh& mesh : object.meshes) {
    for (const V3f& p : mesh.positions) box.extendBy(V3d(p));
  }
  for (const Sphere& s : object.spheres) {
    box.extendBy(V3d(s.center) - V3d(s.radius));
    box.extendBy(V3d(s.center) + V3d(s.radius));
  }
  return box;
}

Box3d transform_box(const Box3d& box, const M44d& m) {
  Box3d out;
  if (box.isEmpty()) return out;
  for (int corner = 0; corner < 8; ++corner) {
    out.extendBy(transform_point(m, V3d(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                                        corner & 4 ? box.max.z : box.min.z)));
  }
  return out;
}

bool is_in_range(const Box3d& object_box, const M44d& to_world) {
  return in_range(object_box) && in_range(transform_box(object_box, to_world));
}

bool is_traceable(const M44d& to_world, double radius) {
  const Linear linear(to_world), cofactors = linear.normal_transform();
  const double largest = std::max({length(cofactors.x), length(cofactors.y), length(cofactors.z)});
  return 4.0 * radius * largest <= kMaxObjectReach * std::abs(linear.determinant());
}

void set_placement(InstanceRecord& record, const M44d& to_world) {
  const Linear linear(to_world), normals = linear.normal_transform();
  const V3d translation(to_world[3][0], to_world[3][1], to_world[3][2]);
  // Cofactors scale with the square of the transform: bring them to order one before they become float.
  const double scale = 1 / std::max({length(normals.x), length(normals.y), length(normals.z)});
  const V3d columns[4] = {linear.x, linear.y, linear.z, translation};
  for (int c = 0; c < 4; ++c) {
    for (int r = 0; r < 3; ++r) record.to_world[3 * c + r] = float(columns[c][r]);
  }
  const V3d normal_columns[3] = {normals.x * scale, normals.y * scale, normals.z * scale};
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) record.normal_to_world[3 * c + r] = float(normal_columns[c][r]);
  }
  record.offset_scale = float(length(linear.x) + length(linear.y) + length(linear.z));
  record.offset =
      float(std::max({std::abs(translation.x), std::abs(translation.y), std::abs(translation.z)})) * kOffsetFactor;
}

M44d rebased(const M44d& to_world, const V3d& origin) {
  M44d m = to_world;
  for (int i = 0; i < 3; ++i) m[3][i] -= origin[i];
  return m;
}

}  // namespace helio
