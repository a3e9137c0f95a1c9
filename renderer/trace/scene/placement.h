// Where instances stand: transforms in double, boxes, and the record by which a ray's hit is taken to the world.
#pragma once

#include <optional>

#include "renderer/base/math.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

struct InstanceRecord;  // trace/scene/scene_data.h

// The linear part of a transform. Rows are the images of the axes.
struct Linear {
  V3d x, y, z;
  explicit Linear(const M44d& m)
      : x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]), z(m[2][0], m[2][1], m[2][2]) {}
  explicit Linear(const InstanceRecord& record);
  double determinant() const { return dot(x, cross(y, z)); }
  V3d apply(const V3f& v) const { return x * double(v.x) + y * double(v.y) + z * double(v.z); }
  // Inverse transpose up to a positive factor: cofactors, with the sign of the determinant.
  Linear normal_transform() const;
  // The factor by which all lengths grow, or 0 when there is no single one.
  double uniform_scale() const;
};

// Whether the axes of what is transformed no longer point where they did.
bool turns(const Linear& linear);

V3d transform_point(const M44d& m, const V3d& p);

// Finite, and not so flat that a volume becomes less than 1e-12 of the product of its sides.
bool is_usable_transform(const M44d& m);

// For a transform without an inverse that presses a volume flat and leaves it an area (a scale of 0 along one axis): one
// that leaves it a thickness, too little to be seen, so that it has an inverse, normals and a front. `centre`, of what
// is placed, goes where `m` takes it; fronts are those of a mirrored placement or not. Nothing where no area is left.
std::optional<M44d> with_thickness(const M44d& m, const Object& object, const V3d& centre, bool mirrored);

// Of positions and spheres, in the object's space. Empty for an object without geometry.
Box3d object_box(const Object& object);
// The box around the transformed corners. Empty stays empty.
Box3d transform_box(const Box3d& box, const M44d& m);
// Whether what is placed stays within kMaxCoordinate, in its own space and in the world's.
bool is_in_range(const Box3d& object_box, const M44d& to_world);

// Inside an instance the ray is in the object's space: there, too, its numbers must be floats that can be traced.
// `radius`: of the scene around its origin.
bool is_traceable(const M44d& to_world, double radius);

// Transforms and offsets of an instance; `to_world` as the record's own space has it. The parts and emitters are left
// as they are.
void set_placement(InstanceRecord& record, const M44d& to_world);
// `to_world` followed by the move that makes `origin` the origin.
M44d rebased(const M44d& to_world, const V3d& origin);

}  // namespace helio
