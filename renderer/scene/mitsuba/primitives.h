// Shapes that the file only names: unit rectangle, cube, disk, cylinder and sphere as meshes, in Mitsuba's local
// coordinates.
#pragma once

#include "renderer/scene/description/scene_description.h"

namespace helio::mitsuba {

// Segments of a full turn. A disk, cylinder or dark sphere stays within 1 - cos(pi / kSegments) = 1.9e-5 of its radius.
inline constexpr int kSegments = 512;

TriangleMesh rectangle_mesh();  // [-1, 1]^2 in z = 0, facing +z, uv over [0, 1]^2
TriangleMesh cube_mesh();       // [-1, 1]^3, facing outwards, uv over [0, 1]^2 on each side
// Radius 1 in z = 0, facing +z; u the radius, v the angle over a turn. `rings` >= 1: with one, v grows as if by length
// wherever it is within a triangle; more make the slope along it right, which bump maps need.
TriangleMesh disk_mesh(int rings = 1);
inline constexpr int kBumpedRings = 96;
// Open tube from p0 to p1, smooth, facing outwards; u the angle over a turn, v along the axis. p0 != p1, radius > 0.
TriangleMesh cylinder_mesh(const V3d& p0, const V3d& p1, double radius);
// Smooth, facing outwards; u the angle around z over a turn, v that from +z over half a turn. radius > 0; `segments`
// of a turn, even.
TriangleMesh sphere_mesh(const V3d& center, double radius, int segments = kSegments);
// Of a sphere that shines: every triangle is a light of its own, 1.3 KB.
inline constexpr int kLampSegments = 128;

// The other side becomes the front.
void flip(TriangleMesh& mesh);

}  // namespace helio::mitsuba
