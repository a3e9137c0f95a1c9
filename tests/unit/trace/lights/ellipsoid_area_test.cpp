// The area of ellipsoids against closed forms of spheroids and, for three different axes, against quadrature.
#include "renderer/trace/lights/ellipsoid_area.h"

#include <gtest/gtest.h>

#include <cmath>

namespace helio {
namespace {

constexpr double kPiD = std::numbers::pi;

// Radii a, a, c: oblate 2 pi a^2 (1 + (1 - e^2) / e atanh e), prolate 2 pi a^2 (1 + c / (a e) asin e).
double spheroid_area(double a, double c) {
  if (c < a) {
    const double e = std::sqrt((1 - c / a) * (1 + c / a));
    return 2 * kPiD * a * a * (1 + c * c / (a * a) / e * std::log((1 + e) * a / c));
  }
  const double e = std::sqrt((1 - a / c) * (1 + a / c));
  return 2 * kPiD * a * a * (1 + c / (a * e) * std::asin(e));
}

TEST(EllipsoidArea, SpheroidsMatchTheirClosedForms) {
  EXPECT_NEAR(ellipsoid_area({3, 0, 0}, {0, 0, 3}, {0, 3, 0}).area, 36 * kPiD, 1e-11);
  for (const double c : {1e-9, 1e-6, 1e-3, 0.1, 0.5, 0.99, 1.01, 2.0, 30.0, 1e4, 1e9}) {
    const double expected = spheroid_area(1, c);
    const EllipsoidArea found = ellipsoid_area({0.6, 0.8, 0}, {0.8, -0.6, 0}, {0, 0, c});
    EXPECT_NEAR(found.area, expected, 1e-9 * expected) << c;
    EXPECT_NEAR(found.stretch, std::max(1.0, c), 1e-9 * std::max(1.0, c)) << c;  // a a or a c
  }
}

// A sheared and mirrored map: the integral of |C n| over the unit sphere, by the midpoint rule with a step of 0.2
// degrees.
TEST(EllipsoidArea, ShearedMapsMatchQuadrature) {
  const V3d e1(0.9, 0.3, 0), e2(-0.2, 0.4, 0.1), e3(0, 0.2, -0.5);
  const V3d c1 = cross(e2, e3), c2 = cross(e3, e1), c3 = cross(e1, e2);
  constexpr int kRings = 900, kSectors = 1800;
  double sum = 0, most = 0;
  for (int i = 0; i < kRings; ++i) {
    const double theta = kPiD * (i + 0.5) / kRings;
    for (int j = 0; j < kSectors; ++j) {
      const double phi = 2 * kPiD * j / kSectors;
      const double stretch = length(c1 * (std::sin(theta) * std::cos(phi)) + c2 * (std::sin(theta) * std::sin(phi)) +
                                    c3 * std::cos(theta));
      sum += stretch * std::sin(theta);
      most = std::max(most, stretch);
    }
  }
  const double expected = sum * (kPiD / kRings) * (2 * kPiD / kSectors);
  const EllipsoidArea found = ellipsoid_area(e1, e2, e3);
  EXPECT_NEAR(found.area, expected, 3e-6 * expected);
  EXPECT_NEAR(found.stretch, most, 1e-5 * most);
  EXPECT_GE(found.stretch, most);
}

TEST(EllipsoidArea, ScalesWithTheSquareAndSurvivesExtremes) {
  const V3d e1(0.9, 0.3, 0), e2(-0.2, 0.4, 0.1), e3(0, 0.2, -0.5);
  const double unit = ellipsoid_area(e1, e2, e3).area;
  for (const double s : {1e-150, 1e-20, 1e9, 1e150}) {
    EXPECT_NEAR(ellipsoid_area(e1 * s, e2 * s, e3 * s).area / (unit * s * s), 1, 1e-11) << s;
  }
  // Flat: both sides of a disk. A line has no area; neither has what is not finite.
  EXPECT_NEAR(ellipsoid_area({2, 0, 0}, {0, 2, 0}, {0, 0, 0}).area, 8 * kPiD, 1e-11);
  EXPECT_EQ(ellipsoid_area({2, 0, 0}, {0, 0, 0}, {0, 0, 0}).area, 0);
  EXPECT_EQ(ellipsoid_area({2, 0, 0}, {0, std::nan(""), 0}, {0, 0, 1}).area, 0);
}

}  // namespace
}  // namespace helio
