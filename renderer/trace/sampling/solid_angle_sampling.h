// Directions distributed uniformly over the solid angle that a rectangle or a triangle subtends at a point.
//
// Near a light these remove the d^2 / cos factor that sampling its area leaves in the estimate. They cost some tens of
// nanoseconds more, so light_shapes.h turns to them only where they pay.
#pragma once

#include "renderer/base/math.h"

namespace helio {

// Below this solid angle (steradian) rounding in the angle sums exceeds 1e-4 of it: sample the area instead.
inline constexpr float kMinSolidAngle = 0.02f;

// Urena, Fajardo, King 2013, "An Area-Preserving Parametrization for Spherical Rectangles". The angles are taken by
// atan2 from unnormalised edge-plane normals, so that thin rectangles and grazing views keep their digits.
class SphericalRectangle {
 public:
  // The rectangle corner + s e1 + t e2 (s, t in [0, 1], e1 perpendicular to e2, none of zero length) seen from `point`.
  SphericalRectangle(const V3f& point, const V3f& corner, const V3f& e1, const V3f& e2);

  float solid_angle() const { return solid_angle_; }  // steradian, [0, 2 pi]

  // (s, t) of the point on the rectangle whose direction is uniform in solid angle for uniform u in [0, 1)^2.
  // Precondition: solid_angle() > 0.
  V2f sample(const V2f& u) const;

 private:
  float x0_, x1_, y0_, y1_, z0_, b0_, b1_, k_, solid_angle_;
};

// Arvo 1995, "Stratified Sampling of Spherical Triangles"; the solid angle by Van Oosterom and Strackee 1983.
class SphericalTriangle {
 public:
  // The triangle p0, p0 + e1, p0 + e2 seen from `point`.
  SphericalTriangle(const V3f& point, const V3f& p0, const V3f& e1, const V3f& e2);

  float solid_angle() const { return solid_angle_; }  // steradian, [0, 2 pi]

  // Unit direction, uniform in solid angle. Precondition: solid_angle() > 0.
  V3f sample(const V2f& u) const;

 private:
  V3f a_, b_, c_;  // unit directions to the corners
  float solid_angle_;
};

}  // namespace helio
