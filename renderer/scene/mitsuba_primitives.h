// Shapes that the file only names: unit rectangle, cube, disk and cylinder as meshes, in Mitsuba's local coordinates.
#pragma once

#include "renderer/scene/scene_description.h"

namespace helio::mitsuba {

// Segments of a full turn. A disk or cylinder stays within 1 - cos(pi / kSegments) = 1.9e-5 of its radius.
inline constexpr int kSegments = 512;

TriangleMesh rectangle_mesh();  // [-1, 1]^2 in z = 0, facing +z, uv over [0, 1]^2
TriangleMesh cube_mesh();       // [-1, 1]^3, facing outwards, uv over [0, 1]^2 on each side
TriangleMesh disk_mesh();       // radius 1 in z = 0, facing +z; u the radius, v the angle over a turn
// Open tube from p0 to p1, smooth, facing outwards; u the angle over a turn, v along the axis. p0 != p1, radius > 0.
TriangleMesh cylinder_mesh(const V3d& p0, const V3d& p1, double radius);

// The other side becomes the front.
void flip(TriangleMesh& mesh);

// Tangents along growing u, averaged over the triangles of a vertex, bitangents to their left (w = 1): the frame that
// Mitsuba's normal maps are in. Leaves meshes without texture coordinates alone.
void add_u_tangents(TriangleMesh& mesh);

}  // namespace helio::mitsuba
