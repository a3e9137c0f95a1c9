// Directions to single shapes: distributed as their density says, the density of a hit equal to that of the sample,
// irradiances equal to closed forms, everything finite at the extremes.
#include "renderer/trace/lights/light_shapes.h"

#include <gtest/gtest.h>

#include "renderer/base/clock.h"
#include "renderer/trace/sampling/solid_angle_sampling.h"
#include "tests/support/chi_square.h"
#include "tests/unit/trace/lights/light_test_scenes.h"

namespace helio {
namespace {

using test::Random;

const V3f kNormal(0, 0, 1);
const V3f kE1(1, 0.1f, 0), kSkewed(0.3f, 1, 0);

AreaShape triangle(bool two_sided = false) {
  return make_triangle_shape({0.2f, -0.1f, 0}, kE1, kSkewed, kNormal, two_sided);
}
AreaShape rectangle(bool two_sided = false) {
  return make_parallelogram_shape({-0.5f, -0.2f, 0}, {1, 0, 0}, {0, 0.4f, 0}, kNormal, two_sided);
}
AreaShape parallelogram(bool two_sided = false) {
  return make_parallelogram_shape({-0.5f, -0.2f, 0}, kE1, kSkewed, kNormal, two_sided);
}

// Counts of (s, t) against the integral of the density over the light's area, pdf_w cos / d^2.
test::ChiSquareResult planar_chi_square(const AreaShape& shape, const V3f& point, std::uint64_t seed) {
  constexpr int kCells = 12, kSubdivision = 12, kCount = 1000000;
  std::vector<double> observed(kCells * kCells + 1), expected(kCells * kCells + 1);
  Random random(seed);
  for (int i = 0; i < kCount; ++i) {
    const ShapeSample s = sample_shape(shape, point, random.next_v2f());
    if (!(s.pdf_w > 0)) {
      ++observed.back();
      continue;
    }
    const int x = std::min(int(s.st.x * kCells), kCells - 1), y = std::min(int(s.st.y * kCells), kCells - 1);
    ++observed[std::size_t(y * kCells + x)];
  }
  double total = 0;
  const bool is_triangle = shape.kind == ShapeKind::triangle;
  const int n = kCells * kSubdivision;
  const double cell_area = double(shape.area) * (is_triangle ? 2 : 1) / n / n;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      // Cells cut by the hypotenuse count half, at the centroid of the half that is inside.
      const bool cut = is_triangle && x + y == n - 1;
      if (is_triangle && x + y >= n) continue;
      const float offset = cut ? 1.0f / 3 : 0.5f;
      const V3f d =
          shape.p0 + shape.e1 * ((float(x) + offset) / float(n)) + shape.e2 * ((float(y) + offset) / float(n)) - point;
      const float distance = length(d), cosine = -dot(shape.normal, d) / distance;
      const double density =
          double(pdf_w_shape(shape, point, d / distance, distance, cosine)) * std::abs(cosine) / distance / distance;
      const double mass = density * cell_area * (cut ? 0.5 : 1.0);
      expected[std::size_t(y / kSubdivision * kCells + x / kSubdivision)] += mass * kCount;
      total += mass;
    }
  }
  EXPECT_NEAR(total, 1, 5e-3);
  expected.back() = std::max(0.0, (1 - total) * kCount);
  return test::chi_square_test(observed, expected);
}

struct PlanarCase {
  const char* name;
  AreaShape shape;
  V3f point;
};

TEST(LightShapes, PlanarSamplesFollowTheirDensity) {
  const std::vector<PlanarCase> cases = {
      {"triangle, far", triangle(), {0.3f, 2, 4}},
      {"triangle, near", triangle(), {0.6f, 0.4f, 0.4f}},
      {"triangle, near, seen at a slant", triangle(), {-0.1f, 0.2f, 0.3f}},
      {"triangle, near, from behind", triangle(true), {0.5f, 0.2f, -0.3f}},
      {"rectangle, far", rectangle(), {2, 1, 3}},
      {"rectangle, near", rectangle(), {0.1f, 0.1f, 0.3f}},
      {"rectangle, near, beside", rectangle(), {-0.8f, 0.1f, 0.2f}},
      {"rectangle, near, from behind", rectangle(true), {0.2f, 0, -0.25f}},
      {"parallelogram, far", parallelogram(), {2, 1, 3}},
      {"parallelogram, near", parallelogram(), {0.3f, 0.5f, 0.4f}},
  };
  std::uint64_t seed = 1;
  for (const PlanarCase& c : cases) {
    const test::ChiSquareResult result = planar_chi_square(c.shape, c.point, seed++);
    EXPECT_TRUE(result.passes(test::kSignificance, int(cases.size()))) << c.name << ": " << result.summary();
  }
}

TEST(LightShapes, SphereSamplesFollowTheirDensity) {
  struct Case {
    const char* name;
    V3f point;
    float radius;
    bool two_sided;
  };
  const V3f center(0.3f, -0.2f, 0.5f);
  const std::vector<Case> cases = {
      {"outside", center + V3f(2, 1, -1), 0.7f, false},
      {"just outside", center + V3f(0, 1.0001f, 0), 1, false},
      {"small and far", center + V3f(0, 300, 400), 0.5f, false},
      {"inside", center + V3f(0.2f, 0.5f, 0.1f), 1, true},
  };
  std::uint64_t seed = 11;
  for (const Case& c : cases) {
    const AreaShape shape = make_sphere_shape(center, c.radius, c.two_sided);
    const V3d axis = normalize(V3d(center) - V3d(c.point));
    const bool inside = length(center - c.point) < c.radius;
    const double sine = inside ? 1 : double(c.radius) / length(center - c.point);
    test::SphereHistogram histogram(V3f(axis), 0.9 * sine);  // the rim lies inside a row of cells
    Random random(seed++);
    for (int i = 0; i < 1000000; ++i) {
      const ShapeSample s = sample_shape(shape, c.point, random.next_v2f());
      s.pdf_w > 0 ? histogram.add(s.direction) : histogram.add_elsewhere();
    }
    const double rim = inside ? -2 : std::sqrt(1 - sine * sine);
    double mass = 0;
    const test::ChiSquareResult result = histogram.test(
        [&](const V3f& w) {
          if (inside) return double(pdf_w_shape(shape, c.point, w, 1, -1));
          return dot(normalize(V3d(w)), axis) >= rim ? double(pdf_w_shape(shape, c.point, w, 1, 1)) : 0.0;
        },
        &mass);
    EXPECT_NEAR(mass, 1, 2e-3) << c.name;
    EXPECT_TRUE(result.passes(test::kSignificance, int(cases.size()))) << c.name << ": " << result.summary();
  }
}

// The solid angles against independent forms: a rectangle centred below the point subtends
// 4 asin(a b / sqrt((a^2 + h^2)(b^2 + h^2))), a cube's face from the cube's centre 4 pi / 6, an octant's triangle pi
// / 2.
TEST(LightShapes, SolidAnglesMatchClosedForms) {
  const auto expected = [](double a, double b, double h) {
    return 4 * std::asin(a * b / std::sqrt((a * a + h * h) * (b * b + h * h)));
  };
  for (const float h : {0.01f, 0.1f, 1.0f, 3.0f}) {
    for (const float b : {0.02f, 0.5f, 1.0f}) {
      const SphericalRectangle r({0, 0, h}, {-1, -b, 0}, {2, 0, 0}, {0, 2 * b, 0});
      EXPECT_NEAR(r.solid_angle(), expected(1, b, h), 3e-6 + 1e-5 * expected(1, b, h)) << h << ' ' << b;
    }
  }
  EXPECT_NEAR(SphericalRectangle({0, 0, 0}, {-1, -1, 1}, {2, 0, 0}, {0, 2, 0}).solid_angle(), 4 * kPi / 6, 1e-5);
  EXPECT_NEAR(SphericalTriangle({0, 0, 0}, {1, 0, 0}, {-1, 1, 0}, {-1, 0, 1}).solid_angle(), kPi / 2, 1e-5);
  EXPECT_NEAR(SphericalTriangle({0, 0, 1e-3f}, {-1, -1, 0}, {2, 0, 0}, {1, 2, 0}).solid_angle(), kTwoPi, 2e-2);
}

Rgb irradiance(const AreaShape& shape, const V3f& point, const V3f& n, int side, Random& random) {
  double sum = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const V2f jitter = random.next_v2f();
      const V2f u((float(x) + jitter.x) / float(side), (float(y) + jitter.y) / float(side));
      const ShapeSample s =
          sample_shape(shape, point, {std::min(u.x, kOneMinusEpsilon), std::min(u.y, kOneMinusEpsilon)});
      if (s.pdf_w > 0) sum += std::max(0.0f, dot(n, s.direction)) / s.pdf_w;
    }
  }
  return Rgb(float(sum / side / side));
}

TEST(LightShapes, IrradianceMatchesLambertsPolygonFormula) {
  Random random(5);
  for (const V3f& point : {V3f(0.1f, 0.1f, 0.15f), V3f(0.4f, 0.3f, 0.6f), V3f(-0.4f, 1, 1.2f), V3f(3, 2, 5)}) {
    const V3f n(0, 0, -1);
    for (const AreaShape& s : {rectangle(), parallelogram()}) {
      const double expected = test::quad_irradiance(s.p0, s.e1, s.e2, point, n);
      EXPECT_NEAR(irradiance(s, point, n, 300, random).x, expected, 3e-3 * expected) << point;
    }
    const AreaShape t = triangle();
    const double expected = test::polygon_irradiance({t.p0, t.p0 + t.e1, t.p0 + t.e2}, point, n);
    EXPECT_NEAR(irradiance(t, point, n, 300, random).x, expected, 3e-3 * expected) << point;
  }
}

TEST(LightShapes, IrradianceMatchesTheSphereFormFactor) {
  Random random(6);
  const V3f center(0, 0, 2);
  for (const float radius : {1e-3f, 0.1f, 1.0f, 1.9f}) {
    const AreaShape s = make_sphere_shape(center, radius, false);
    const double expected = test::sphere_irradiance(center, radius, {0, 0, 0}, kNormal);
    EXPECT_NEAR(irradiance(s, {0, 0, 0}, kNormal, 200, random).x, expected, 1e-3 * expected) << radius;
  }
  // From inside a two-sided sphere: pi.
  const AreaShape s = make_sphere_shape(center, 3, true);
  EXPECT_NEAR(irradiance(s, {0, 0, 0}, kNormal, 200, random).x, kPi, 1e-2);
}

AreaShape skewed_ellipsoid(bool two_sided = false) {
  return make_ellipsoid_shape({0.1f, 0.2f, 0.3f}, {0.9f, 0.3f, 0}, {-0.2f, 0.4f, 0.1f}, {0, 0.2f, -0.5f}, two_sided);
}

// From inside, directions reach the whole sphere with a density without edges.
TEST(LightShapes, EllipsoidSamplesFollowTheirDensityInside) {
  const AreaShape shape = skewed_ellipsoid(true);
  const V3f point = shape.center + shape.e1 * 0.4f - shape.e2 * 0.3f;
  test::SphereHistogram histogram({0, 0, 1}, 0.5);
  Random random(31);
  for (int i = 0; i < 1000000; ++i) {
    const ShapeSample s = sample_shape(shape, point, random.next_v2f());
    s.pdf_w > 0 ? histogram.add(s.direction) : histogram.add_elsewhere();
  }
  double mass = 0;
  const test::ChiSquareResult result =
      histogram.test([&](const V3f& w) { return double(pdf_w_shape(shape, point, normalize(w), 1, -1)); }, &mass);
  EXPECT_NEAR(mass, 1, 2e-3);
  EXPECT_TRUE(result.passes(test::kSignificance, 1)) << result.summary();
}

// From outside, in the space where the ellipsoid is the unit sphere and what is seen of it a round cone. With M the
// inverse of the map, direction w goes to M w / |M w|, and solid angles grow by |det M| / |M w|^3.
TEST(LightShapes, EllipsoidSamplesFollowTheirDensityOutside) {
  const AreaShape shape = skewed_ellipsoid();
  const V3d a(shape.e1), b(shape.e2), c(shape.e3);
  const double determinant = dot(a, cross(b, c));
  const auto into_sphere = [&](const V3d& v) {
    return V3d(dot(cross(b, c), v), dot(cross(c, a), v), dot(cross(a, b), v)) * (1 / determinant);
  };
  const auto out_of_sphere = [&](const V3d& v) { return a * v.x + b * v.y + c * v.z; };
  std::uint64_t seed = 35;
  const std::vector<V3f> points = {{0.4f, -0.3f, -1.2f}, {4, 7, 1}, {0.1f, 0.2f, 0.85f}};
  for (const V3f& point : points) {
    const V3d to_center = into_sphere(V3d(shape.center) - V3d(point));
    const V3d axis = normalize(to_center);
    const double sine = 1 / length(to_center), rim = std::sqrt(1 - sine * sine);
    ASSERT_LT(sine, 1);
    test::SphereHistogram histogram(V3f(axis), 0.9 * sine);
    Random random(seed++);
    for (int i = 0; i < test::kChiSquareSamples; ++i) {
      const ShapeSample s = sample_shape(shape, point, random.next_v2f());
      s.pdf_w > 0 ? histogram.add(V3f(normalize(into_sphere(V3d(s.direction))))) : histogram.add_elsewhere();
    }
    double mass = 0;
    const test::ChiSquareResult result = histogram.test(
        [&](const V3f& inside) {
          const V3d v = normalize(V3d(inside));
          if (dot(v, axis) < rim) return 0.0;
          const V3d w = out_of_sphere(v);
          const double density = double(pdf_w_shape(shape, point, V3f(normalize(w)), 1, 1));
          return density * std::abs(determinant) / std::pow(length(w), 3);
        },
        &mass);
    EXPECT_NEAR(mass, 1, 2e-3) << point;
    EXPECT_TRUE(result.passes(test::kSignificance, int(points.size()))) << point << ": " << result.summary();
  }
}

// A spheroid with radii a, a, c seen along its axis from distance d fills a cone whose tangent is a / sqrt(d^2 - c^2):
// the circle of the unit sphere's tangent cone, scaled. Irradiance pi sin^2, solid angle 2 pi (1 - cos).
TEST(LightShapes, IrradianceMatchesTheSpheroidsCone) {
  Random random(32);
  const double d = 2;
  for (const double a : {0.1, 1.0, 5.0}) {
    for (const double c : {0.05, 0.5, 1.9}) {
      const AreaShape s = make_ellipsoid_shape({0, 0, 2}, {float(0.6 * a), float(0.8 * a), 0},
                                               {float(0.8 * a), float(-0.6 * a), 0}, {0, 0, float(c)}, false);
      const double tangent_squared = a * a / (d * d - c * c), sine_squared = tangent_squared / (1 + tangent_squared);
      EXPECT_NEAR(irradiance(s, {0, 0, 0}, kNormal, 200, random).x, kPi * sine_squared, 3e-3 * kPi * sine_squared)
          << a << ' ' << c;
      double solid_angle = 0;
      constexpr int kSide = 200;
      for (int i = 0; i < kSide * kSide; ++i) {
        const V2f u((float(i % kSide) + 0.5f) / kSide, (float(i / kSide) + 0.5f) / kSide);
        solid_angle += 1 / sample_shape(s, {0, 0, 0}, u).pdf_w / (kSide * kSide);
      }
      const double expected = kTwoPi * (1 - std::sqrt(1 - sine_squared));
      EXPECT_NEAR(solid_angle, expected, 1e-2 * expected) << a << ' ' << c;
    }
  }
}

// Off every axis: against directions on a fine grid, each intersected with the ellipsoid in double.
TEST(LightShapes, IrradianceOfASkewedEllipsoidMatchesARayGrid) {
  Random random(33);
  const AreaShape s = skewed_ellipsoid();
  const AreaEmitter emitter = test::ellipsoid_emitter(s.center, s.e1, s.e2, s.e3, 1);
  const V3f point(0.4f, -0.3f, -1.2f);
  constexpr int kRings = 600, kSectors = 1200;
  double expected = 0;
  for (int i = 0; i < kRings; ++i) {
    for (int j = 0; j < kSectors; ++j) {
      const double z = (i + 0.5) / kRings, phi = 2 * std::numbers::pi * (j + 0.5) / kSectors, r = std::sqrt(1 - z * z);
      const V3f w(float(r * std::cos(phi)), float(r * std::sin(phi)), float(z));
      if (test::hit_emitter(emitter, point, w)) expected += z * 2 * std::numbers::pi / (kRings * kSectors);
    }
  }
  EXPECT_NEAR(irradiance(s, point, kNormal, 300, random).x, expected, 2e-3 * expected);
}

TEST(LightShapes, EllipsoidAreaMatchesTheSpheroidFormula) {
  EXPECT_NEAR(make_ellipsoid_shape({0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}, false).area, 16 * kPi, 1e-3);
  // Oblate, radii 2, 2, 1: 2 pi a^2 (1 + (1 - e^2) / e atanh e), e^2 = 3 / 4.
  const double e = std::sqrt(0.75), expected = 8 * kPi * (1 + 0.25 / e * std::atanh(e));
  EXPECT_NEAR(make_ellipsoid_shape({0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {0, 0, 2}, false).area, expected, 2e-2);
}

// Near a light the irradiance estimates that sample its solid angle must be better by more than what they cost.
TEST(LightShapes, SolidAngleSamplingPaysNearTheLight) {
  for (const AreaShape& near : {rectangle(), triangle()}) {
    AreaShape far = near;
    far.near_squared = 0;
    double variance_area = 0, variance_angle = 0;
    Random random(9);
    for (int p = 0; p < 50; ++p) {
      const float phi = kTwoPi * random.next_float(), z = 0.05f + 0.9f * random.next_float();
      const float r = std::sqrt(1 - z * z);
      const V3f direction(r * std::cos(phi), r * std::sin(phi), z);
      const V3f point = near.center + direction * (0.5f * std::sqrt(near.near_squared));
      for (int i = 0; i < 400; ++i) {
        const V2f u = random.next_v2f();
        const auto square = [&](const AreaShape& shape) {
          const ShapeSample s = sample_shape(shape, point, u);
          return s.pdf_w > 0 ? sqr(std::max(0.0f, -dot(direction, s.direction)) / s.pdf_w) : 0.0f;
        };
        variance_area += square(far);
        variance_angle += square(near);
      }
    }
    EXPECT_LT(variance_angle * 1.5, variance_area);
  }
}

// The density of a hit found by intersecting the shape is that of the sample, for points everywhere around it.
TEST(LightShapes, HitAndSampleAgreeOnTheDensity) {
  Random random(21);
  const V3f a(-0.5f, -0.2f, 0);
  std::vector<std::pair<AreaShape, AreaEmitter>> planar;
  for (const bool two_sided : {false, true}) {
    AreaEmitter e = test::triangle_emitter(a, a + kE1, a + kSkewed, 1, two_sided);
    planar.emplace_back(make_triangle_shape(e.p0, e.e1, e.e2, e.normal, two_sided), e);
    e = test::sphere_emitter(a, 0.8f, 1, two_sided);
    planar.emplace_back(make_sphere_shape(a, 0.8f, two_sided), e);
    const AreaShape ellipsoid = skewed_ellipsoid(two_sided);
    planar.emplace_back(
        ellipsoid, test::ellipsoid_emitter(ellipsoid.center, ellipsoid.e1, ellipsoid.e2, ellipsoid.e3, 1, two_sided));
  }
  int compared = 0;
  for (const auto& [shape, emitter] : planar) {
    for (int i = 0; i < 20000; ++i) {
      const float reach = std::pow(10.0f, 4 * random.next_float() - 2);
      const V3f point = V3f(random.next_float() - 0.5f, random.next_float() - 0.5f, random.next_float() - 0.5f) * reach;
      const ShapeSample s = sample_shape(shape, point, random.next_v2f());
      if (!(s.pdf_w > 0)) continue;
      EXPECT_NEAR(length(s.direction), 1, 1e-5);
      const auto hit = test::hit_emitter(emitter, point, s.direction);
      if (!hit || std::abs(hit->cos_light) < 0.01f) continue;  // rounding at edges and rims, grazing
      const float pdf_w = pdf_w_shape(shape, point, s.direction, hit->distance, hit->cos_light);
      ASSERT_NEAR(pdf_w, s.pdf_w, 1e-4f * s.pdf_w) << point << " distance " << s.distance;
      ++compared;
    }
  }
  EXPECT_GT(compared, 60000);
}

TEST(LightShapes, ExtremesStayFinite) {
  const std::vector<V3f> points = {{0, 0, 0},      {-0.5f, -0.2f, 0},  {0.5f, -0.2f, 0},    {5, 5, 0},
                                   {1e7f, 0, 0},   {1e7f, 1e7f, 1e7f}, {0, 0, 1e-7f},       {0, 0, -1e-7f},
                                   {0, 0, 1e-20f}, {0.2f, 0, 1e7f},    {0.7f, 0.3f, 1e-3f}, {0, 0, 1e7f}};
  const float tiny = 1e-4f, huge = 1e6f;
  const std::vector<AreaShape> shapes = {triangle(),
                                         triangle(true),
                                         rectangle(),
                                         rectangle(true),
                                         parallelogram(),
                                         parallelogram(true),
                                         make_sphere_shape({0, 0, 0}, 1, false),
                                         make_sphere_shape({0, 0, 0}, 1, true),
                                         make_sphere_shape({0, 0, 0}, tiny, false),
                                         make_sphere_shape({0, 0, 0}, huge, true),
                                         skewed_ellipsoid(),
                                         skewed_ellipsoid(true),
                                         make_ellipsoid_shape({0, 0, 0}, {huge, 0, 0}, {0, 1, 0}, {0, 0, tiny}, true),
                                         make_triangle_shape({0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}, kNormal, false),
                                         make_parallelogram_shape({0, 0, 0}, {huge, 0, 0}, {0, huge, 0}, kNormal, true),
                                         make_parallelogram_shape({0, 0, 0}, {1, 0, 0}, {0, 1e-5f, 0}, kNormal, false)};
  const float last = kOneMinusEpsilon;
  for (const AreaShape& shape : shapes) {
    ASSERT_GT(shape.area, 0);
    for (const V3f& point : points) {
      for (const V2f& u : {V2f(0, 0), V2f(last, last), V2f(0, last), V2f(last, 0), V2f(0.5f, 0.5f), V2f(1e-7f, 0.3f)}) {
        const ShapeSample s = sample_shape(shape, point, u);
        ASSERT_TRUE(std::isfinite(s.pdf_w) && s.pdf_w >= 0) << point;
        if (s.pdf_w == 0) continue;
        ASSERT_TRUE(is_finite(s.direction) && std::abs(length(s.direction) - 1) < 1e-4f) << point << s.direction;
        ASSERT_TRUE(std::isfinite(s.distance) && s.distance > 0) << point;
      }
      for (const float cosine : {-1.0f, -1e-30f, 0.0f, 1e-30f, 1e-3f, 1.0f}) {
        for (const float distance : {1e-20f, 1e-3f, 1.0f, 1e7f}) {
          const float pdf_w = pdf_w_shape(shape, point, {0.6f, 0, -0.8f}, distance, cosine);
          ASSERT_TRUE(std::isfinite(pdf_w) && pdf_w >= 0) << point << ' ' << cosine << ' ' << distance;
        }
      }
    }
  }
}

TEST(LightShapes, OneSidedShapesGiveNothingBehind) {
  for (const AreaShape& shape : {triangle(), rectangle(), parallelogram()}) {
    for (const float z : {-0.2f, -10.0f, 0.0f}) {
      EXPECT_EQ(sample_shape(shape, {0.1f, 0.1f, z}, {0.3f, 0.6f}).pdf_w, 0);
    }
    EXPECT_EQ(pdf_w_shape(shape, {0.1f, 0.1f, -1}, {0, 0, 1}, 1, -1), 0);
  }
  const AreaShape sphere = make_sphere_shape({0, 0, 0}, 1, false);
  EXPECT_EQ(sample_shape(sphere, {0.1f, 0.1f, 0}, {0.3f, 0.6f}).pdf_w, 0);
  EXPECT_EQ(pdf_w_shape(sphere, {0.1f, 0.1f, 0}, {0, 0, 1}, 1, -1), 0);
}

TEST(LightShapes, DegenerateShapesHaveNoArea) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(make_triangle_shape({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, kNormal, false).area, 0);
  EXPECT_EQ(make_triangle_shape({0, 0, 0}, {0, 0, 0}, {0, 0, 0}, kNormal, false).area, 0);
  EXPECT_EQ(make_triangle_shape({0, 0, 0}, {1, 0, 0}, {1, 1e-9f, 0}, kNormal, false).area, 0);
  EXPECT_EQ(make_triangle_shape({nan, 0, 0}, {1, 0, 0}, {0, 1, 0}, kNormal, false).area, 0);
  EXPECT_EQ(make_triangle_shape({0, 0, 0}, {1, 0, 0}, {0, nan, 0}, kNormal, false).area, 0);
  EXPECT_EQ(make_sphere_shape({0, 0, 0}, 0, false).area, 0);
  EXPECT_EQ(make_sphere_shape({0, 0, 0}, -1, false).area, 0);
  EXPECT_EQ(make_sphere_shape({0, nan, 0}, 1, false).area, 0);
  EXPECT_EQ(make_ellipsoid_shape({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, false).area, 0);
  EXPECT_EQ(make_ellipsoid_shape({0, 0, 0}, {1, 0, 0}, {0, nan, 0}, {0, 0, 1}, false).area, 0);
}

}  // namespace
}  // namespace helio
