// Linear blend skinning, baked into the mesh (glTF 2.0, 3.7.3).
#pragma once

#include <vector>

#include "renderer/scene/gltf/geometry.h"

namespace helio::gltf {

// Inverse bind matrix times joint transform, per joint, for row vectors: bind space to the world.
// False after a failure.
bool joint_matrices(const Skin& skin, const std::vector<M44d>& to_world, AccessorReader& reader,
                    std::vector<M44d>& joints);

// Moves the mesh by its binding. Positions become relative to `origin` (world space), which keeps their floats exact.
// Vertices without weights stay in bind space. Triangles that the joints mirror are turned around.
// Where joints press a mesh flat, normals are those of the plane, or of the triangles where that says nothing.
void apply_skin(const std::vector<M44d>& joints, const V3d& origin, PrimitiveGeometry& geometry);

}  // namespace helio::gltf
