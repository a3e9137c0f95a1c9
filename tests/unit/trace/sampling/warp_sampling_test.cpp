#include "renderer/trace/sampling/warp.h"

#include <gtest/gtest.h>

#include <functional>

#include "tests/support/chi_square.h"
#include "tests/support/random.h"

namespace helio::test {
namespace {

constexpr int kTests = 8, kSamples = 1'000'000;

void expect_direction_density(const std::function<V3f(const V2f&)>& warp, const SphereDensity& density, double scale) {
  Random random(11);
  SphereHistogram histogram(V3f(0, 0, 1), scale);
  for (int i = 0; i < kSamples; ++i) {
    const V3f w = warp(random.next_v2f());
    ASSERT_NEAR(length(w), 1, 1e-6);
    histogram.add(w);
  }
  const ChiSquareResult result = histogram.test(density);
  EXPECT_TRUE(result.passes(kSignificance, kTests)) << result.summary();
}

// Uniformity over equal cells of a square of side 2, `inside` giving each cell's share.
void expect_plane_density(const std::function<V2f(const V2f&)>& warp,
                          const std::function<bool(double, double)>& inside) {
  constexpr int kCells = 24, kSub = 64;
  std::vector<double> observed(kCells * kCells), expected(kCells * kCells);
  Random random(12);
  for (int i = 0; i < kSamples; ++i) {
    const V2f p = warp(random.next_v2f());
    const int x = std::clamp(int((p.x + 1) / 2 * kCells), 0, kCells - 1);
    const int y = std::clamp(int((p.y + 1) / 2 * kCells), 0, kCells - 1);
    ++observed[x + kCells * y];
  }
  double total = 0;
  for (int y = 0; y < kCells * kSub; ++y) {
    for (int x = 0; x < kCells * kSub; ++x) {
      const double share = inside((x + 0.5) / (kCells * kSub) * 2 - 1, (y + 0.5) / (kCells * kSub) * 2 - 1);
      expected[x / kSub + kCells * (y / kSub)] += share;
      total += share;
    }
  }
  for (double& e : expected) e *= kSamples / total;
  const ChiSquareResult result = chi_square_test(observed, expected);
  EXPECT_TRUE(result.passes(kSignificance, kTests)) << result.summary();
}

TEST(Warp, CosineHemisphere) {
  expect_direction_density(
      square_to_cosine_hemisphere, [](const V3f& w) { return cosine_hemisphere_pdf_w(w.z); }, 1);
}

TEST(Warp, Sphere) {
  expect_direction_density(
      square_to_sphere, [](const V3f&) { return kSpherePdfW; }, 1);
}

TEST(Warp, Cones) {
  for (const float one_minus_cos : {2.0f, 0.5f, 1e-2f, 1e-6f}) {
    SCOPED_TRACE(one_minus_cos);
    // Half angle from 1 - cos = 2 sin^2(half / 2).
    const double half = 2 * std::asin(std::sqrt(double(one_minus_cos) / 2));
    expect_direction_density([&](const V2f& u) { return square_to_cone(u, one_minus_cos); },
                             [&](const V3f& w) {
                               const double angle = std::atan2(std::hypot(double(w.x), double(w.y)), double(w.z));
                               return angle <= half ? cone_pdf_w(one_minus_cos) : 0;
                             },
                             // Puts the edge of the cone within a row of cells.
                             half * 0.77);
  }
}

TEST(Warp, Disk) {
  expect_plane_density(square_to_disk, [](double x, double y) { return x * x + y * y <= 1; });
}

TEST(Warp, Triangle) {
  expect_plane_density([](const V2f& u) { return square_to_triangle(u) * 2 - V2f(1, 1); },
                       [](double x, double y) { return x + y <= 0; });
}

TEST(Warp, DiskAgreesWithTheLibrarysAngles) {
  Random random(3);
  for (int i = 0; i < 100'000; ++i) {
    const V2f u = random.next_v2f();
    const double a = 2.0 * u.x - 1, b = 2.0 * u.y - 1;
    if (a == 0 && b == 0) continue;
    const bool wide = std::fabs(a) > std::fabs(b);
    const double r = wide ? a : b, phi = wide ? kPi / 4 * (b / a) : kPi / 2 - kPi / 4 * (a / b);
    const V2f p = square_to_disk(u);
    EXPECT_NEAR(p.x, r * std::cos(phi), 3e-7);
    EXPECT_NEAR(p.y, r * std::sin(phi), 3e-7);
  }
}

TEST(Warp, EdgesOfTheSquareStayFinite) {
  for (const float x : {0.0f, 0x1p-24f, 0.5f, kOneMinusEpsilon}) {
    for (const float y : {0.0f, 0x1p-24f, 0.5f, kOneMinusEpsilon}) {
      const V2f u(x, y);
      const V3f w = square_to_cosine_hemisphere(u);
      EXPECT_TRUE(is_finite(w));
      EXPECT_GE(w.z, 0);
      // Only a variate of exactly 0 may give a tangent.
      EXPECT_EQ(w.z > 0, x > 0 && y > 0);
      EXPECT_TRUE(is_finite(square_to_sphere(u)));
      EXPECT_TRUE(is_finite(square_to_cone(u, 1e-9f)));
      const V2f b = square_to_triangle(u);
      EXPECT_GE(b.x, 0);
      EXPECT_GE(b.y, 0);
      EXPECT_LE(b.x + b.y, 1);
    }
  }
}

}  // namespace
}  // namespace helio::test
