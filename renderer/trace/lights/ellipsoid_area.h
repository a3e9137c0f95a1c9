// The surface area of an ellipsoid, to nine digits.
#pragma once

#include "renderer/base/math.h"

namespace helio {

struct EllipsoidArea {
  double area = 0;     // in the square of the unit of the arguments
  double stretch = 0;  // largest area of the surface per area of the unit sphere: product of the two longest semi-axes
};

// Of the unit sphere under (x, y, z) -> x e1 + y e2 + z e3, which may be sheared, flat or mirrored: S = 4 pi R_G(A, B,
// C) (DLMF 19.33.1), where A, B and C are the squared products of two semi-axes: the eigenvalues of C^T C, C the matrix
// of cofactors. Finite vectors whose products stay within double; 0 where the map's rank is below two.
EllipsoidArea ellipsoid_area(const V3d& e1, const V3d& e2, const V3d& e3);

}  // namespace helio
