// Triangles made a little wider, so that no ray slips between neighbours although Embree's robust mode is off.
#pragma once

#include "renderer/base/math.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

// By how much every side moves outwards, in radii of a sphere around the scene. Seen across the ray, Embree's test
// (Moeller and Trumbore 1997) errs by less than 12 x 2^-24 of the distance to the corners (a difference, a cross and a
// dot product; twice that on the third side, but for put_longest_side_last()), typically by a tenth of it, and
// neighbours err independently. Rays start within kEdgeDilationReach radii of the centre, mostly within one. What is
// left are the rare worst roundings and rays that graze the triangle, across which the margin looks narrower:
// watertightness.h measures them.
inline constexpr double kEdgeDilation = 0x1p-19;
inline constexpr double kEdgeDilationReach = 4;

// The most of its own area that edge dilation may add to a mesh: neighbours overlap in twice that share of the surface.
// Beyond, the mesh is too fine for the scene's extent.
inline constexpr double kMaxEdgeDilationShare = 0.1;

// Moves every side outwards by `margin` (scales the triangle about the centre of its incircle). A triangle so thin that
// its neighbours' margins cover it stays as it is.
void widen_triangle(V3f (&corners)[3], double margin);

// The sum of what edge dilation adds to the areas of the triangles over the sum of their areas; 0 for a mesh without
// area.
double edge_dilation_share(const TriangleMesh& mesh, double margin);

// Turns every triangle, its winding kept, so that the side between its second and third corner is the longest. On that
// side the errors of the other two add up; they weigh least where it is long.
void put_longest_side_last(TriangleMesh& mesh);

}  // namespace helio
