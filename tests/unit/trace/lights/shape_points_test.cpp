// Points on lights: on their surface, uniform over its area, with the normal that faces outwards.
#include "renderer/trace/lights/shape_points.h"

#include <gtest/gtest.h>

#include "tests/support/chi_square.h"
#include "tests/support/random.h"

namespace helio {
namespace {

using test::Random;

constexpr int kTests = 8;  // of the chi-square family below

const V3f kE1(1, 0.1f, 0), kE2(0.3f, 1, 0), kNormal(0, 0, 1), kCorner(0.2f, -0.1f, 3);

// Counts in cells of (s, t) that all have the same share of the area; of a triangle, those on the hypotenuse half.
TEST(ShapePoints, PlanarLightsAreCoveredEvenly) {
  for (const bool is_triangle : {false, true}) {
    const AreaShape shape = is_triangle ? make_triangle_shape(kCorner, kE1, kE2, kNormal, false)
                                        : make_parallelogram_shape(kCorner, kE1, kE2, kNormal, false);
    constexpr int kCells = 16;
    const int kCount = test::kChiSquareSamples;
    std::vector<double> observed(kCells * kCells), expected(kCells * kCells);
    for (int y = 0; y < kCells; ++y) {
      for (int x = 0; x < kCells; ++x) {
        const double inside = !is_triangle ? 0.5 : x + y < kCells - 1 ? 1 : x + y == kCells - 1 ? 0.5 : 0;
        expected[std::size_t(y * kCells + x)] = 2 * inside * kCount / (kCells * kCells);
      }
    }
    Random random(1);
    for (int i = 0; i < kCount; ++i) {
      const ShapePoint p = sample_shape_point(shape, random.next_v2f());
      ASSERT_LT(length(kCorner + kE1 * p.st.x + kE2 * p.st.y - p.position), 1e-6f);
      ASSERT_EQ(p.normal, kNormal);
      ++observed[std::size_t(int(p.st.y * kCells) * kCells + int(p.st.x * kCells))];
    }
    const test::ChiSquareResult result = test::chi_square_test(observed, expected);
    EXPECT_TRUE(result.passes(test::kSignificance, kTests)) << is_triangle << ": " << result.summary();
  }
}

TEST(ShapePoints, SpheresAreCoveredEvenly) {
  const AreaShape sphere = make_sphere_shape({1, 2, 3}, 0.5f, true);
  test::SphereHistogram histogram({0, 1, 0});
  Random random(2);
  for (int i = 0; i < test::kChiSquareSamples; ++i) {
    const ShapePoint p = sample_shape_point(sphere, random.next_v2f());
    ASSERT_LT(length((p.position - sphere.center) / 0.5f - p.normal), 1e-5f);
    histogram.add(p.normal);
  }
  const test::ChiSquareResult result = histogram.test([](const V3f&) { return double(kInvPi / 4); });
  EXPECT_TRUE(result.passes(test::kSignificance, kTests)) << result.summary();
}

// The direction in the unit sphere's space has the density area_stretch() / area: that is what uniform over the area
// means, and holds only where the area is right too.
TEST(ShapePoints, EllipsoidsAreCoveredEvenly) {
  const AreaShape ellipsoids[] = {
      make_ellipsoid_shape({0.1f, 0.2f, 0.3f}, {0.9f, 0.3f, 0}, {-0.2f, 0.4f, 0.1f}, {0, 0.2f, -0.5f}, false),
      make_ellipsoid_shape({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0.02f}, false),      // a pancake
      make_ellipsoid_shape({0, 0, 0}, {0.02f, 0, 0}, {0, 3, 0}, {0, 0, 0.01f}, false),  // a needle
      make_ellipsoid_shape({5, 0, 0}, {0, 2, 0}, {2, 0, 0}, {0, 0, 2}, false),          // a mirrored sphere
      make_ellipsoid_shape({0, 0, 0}, {1e-4f, 0, 0}, {0, 1e-4f, 0}, {0, 0, 1e6f}, false),
  };
  std::uint64_t seed = 3;
  for (const AreaShape& shape : ellipsoids) {
    test::SphereHistogram histogram({0.6f, 0, 0.8f});
    Random random(seed++);
    for (int i = 0; i < test::kChiSquareSamples; ++i) {
      const ShapePoint p = sample_shape_point(shape, random.next_v2f());
      // On the surface: the inverse map takes it back to the unit direction. Outwards: away from the centre.
      ASSERT_NEAR(length(p.local), 1, 1e-5f);
      const V3f expected = shape.center + shape.e1 * p.local.x + shape.e2 * p.local.y + shape.e3 * p.local.z;
      ASSERT_EQ(p.position, expected);
      ASSERT_NEAR(length(p.normal), 1, 1e-5f);
      ASSERT_GT(dot(V3d(p.normal), V3d(p.position) - V3d(shape.center)), 0);
      histogram.add(p.local);
    }
    double mass = 0;
    const test::ChiSquareResult result = histogram.test(
        [&](const V3f& w) { return double(area_stretch(shape, normalize(w))) / double(shape.area); }, &mass);
    EXPECT_NEAR(mass, 1, 1e-4) << seed;
    EXPECT_TRUE(result.passes(test::kSignificance, kTests)) << seed << ": " << result.summary();
  }
}

// The normal of the image is perpendicular to the images of the unit sphere's tangents.
TEST(ShapePoints, EllipsoidNormalsArePerpendicular) {
  const AreaShape shape =
      make_ellipsoid_shape({0, 0, 0}, {0.9f, 0.3f, 0}, {-0.2f, 0.4f, 0.1f}, {0, 0.2f, -0.5f}, false);
  Random random(9);
  for (int i = 0; i < 1000; ++i) {
    const ShapePoint p = sample_shape_point(shape, random.next_v2f());
    const Frame frame(p.local);
    for (const V3f& tangent : {frame.s, frame.t}) {
      const V3f image = shape.e1 * tangent.x + shape.e2 * tangent.y + shape.e3 * tangent.z;
      EXPECT_NEAR(dot(p.normal, image) / length(image), 0, 2e-6f);
    }
  }
}

TEST(ShapePoints, ExtremesStayFinite) {
  const float last = kOneMinusEpsilon, huge = 1e8f, tiny = 1e-8f;
  const AreaShape shapes[] = {make_triangle_shape({1e9f, 0, -1e9f}, {huge, 0, 0}, {0, huge, 0}, kNormal, true),
                              make_parallelogram_shape({0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}, kNormal, true),
                              make_sphere_shape({0, 0, 0}, tiny, true), make_sphere_shape({1e9f, 1e9f, 0}, huge, false),
                              make_ellipsoid_shape({0, 0, 0}, {huge, 0, 0}, {0, 1, 0}, {0, 0, tiny}, true)};
  for (const AreaShape& shape : shapes) {
    ASSERT_GT(shape.area, 0);
    for (const V2f& u : {V2f(0, 0), V2f(last, last), V2f(0, last), V2f(last, 0), V2f(0.5f, 0.5f), V2f(1e-7f, 0.3f)}) {
      const ShapePoint p = sample_shape_point(shape, u);
      EXPECT_TRUE(is_finite(p.position) && std::abs(length(p.normal) - 1) < 1e-5f) << int(shape.kind) << ' ' << u;
    }
  }
}

}  // namespace
}  // namespace helio
