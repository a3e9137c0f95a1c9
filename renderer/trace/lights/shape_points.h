// Points on the shapes of area lights, uniform over their area: where paths that start at a light leave it.
#pragma once

#include "renderer/trace/lights/light_shapes.h"

namespace helio {

struct ShapePoint {
  V3f position{0, 0, 0};
  V3f normal{0, 0, 1};  // unit, of the front: planar as the shape says; spheres and ellipsoids outwards
  V3f local{0, 0, 1};   // spheres, ellipsoids: as local_direction()
  V2f st{0, 0};         // planar: the point is p0 + st.x e1 + st.y e2
};

// u in [0, 1)^2; density 1 / shape.area. Precondition: shape.area > 0.
// An ellipsoid's directions are drawn uniformly in the unit sphere's space and kept with a probability in proportion to
// the area that they stand for, at least every second one; what is not kept is drawn again from hashes of u.
ShapePoint sample_shape_point(const AreaShape& shape, const V2f& u);

}  // namespace helio
