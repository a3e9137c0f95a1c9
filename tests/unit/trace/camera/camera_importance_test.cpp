// The camera as the end of light paths, against the rays that it sends out.
#include "renderer/trace/camera/camera_importance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/chi_square.h"

namespace helio {
namespace {

constexpr int kWidth = 37, kHeight = 23;

CameraPose pose_of(Projection projection, double lens_radius) {
  CameraPose pose = look_at({3, 2, 5}, {0.5, -1, 0.2}, {0.1, 1, 0}, 0.9).value();
  pose.projection = projection;
  pose.half_height = 1.7;
  pose.lens_radius = lens_radius;
  pose.focus_distance = 4;
  return pose;
}

struct Kind {
  Projection projection;
  double lens_radius;
};

class CameraImportanceOf : public testing::TestWithParam<Kind> {
 protected:
  const Camera camera_{pose_of(GetParam().projection, GetParam().lens_radius), kWidth, kHeight, {1, -2, 0.5}};
  const CameraImportance importance_{camera_};
  std::mt19937 generator_{5};
  float uniform() { return std::uniform_real_distribution<float>(0, 1)(generator_); }
};

TEST_P(CameraImportanceOf, PointsOfItsRaysAreSeenWhereTheRaysLeft) {
  for (int n = 0; n < 2000; ++n) {
    const int x = int(uniform() * kWidth), y = int(uniform() * kHeight);
    const V2f in_pixel(uniform(), uniform()), lens(uniform(), uniform());
    const CameraRay ray = camera_.generate_ray(x, y, in_pixel, lens);
    const float distance = 0.5f + 20 * uniform();
    const CameraConnection c = importance_.connect(ray.origin + ray.direction * distance, lens);
    const bool at_edge = (x == 0 && in_pixel.x < 1e-3f) || (y == 0 && in_pixel.y < 1e-3f) ||
                         (x == kWidth - 1 && in_pixel.x > 0.999f) || (y == kHeight - 1 && in_pixel.y > 0.999f);
    if (at_edge && c.density == 0) continue;
    ASSERT_GT(c.density, 0);
    EXPECT_NEAR(c.film_x, x + in_pixel.x, 2e-4);
    EXPECT_NEAR(c.film_y, y + in_pixel.y, 2e-4);
    EXPECT_NEAR(length(c.direction + ray.direction), 0, 1e-5);
    EXPECT_DOUBLE_EQ(c.density, importance_.density(-c.direction));
    if (importance_.finite()) {
      EXPECT_NEAR(c.distance, distance, 1e-4f * distance);
    }
  }
}

// How many rays of all pixels pass through a small patch across them, against the density there.
TEST_P(CameraImportanceOf, DensityIsThatOfTheRays) {
  const CameraRay middle = camera_.generate_ray(20, 9, {0.3f, 0.6f}, {0.5f, 0.5f});
  const V3f centre = middle.origin + middle.direction * 6.0f;
  const Frame frame(middle.direction);
  const float side = GetParam().projection == Projection::perspective ? 0.8f : 0.5f;
  constexpr int kRays = 400000;
  double hits = 0;
  for (int n = 0; n < kRays; ++n) {
    const CameraRay ray = camera_.generate_ray(int(uniform() * kWidth), int(uniform() * kHeight),
                                               {uniform(), uniform()}, {uniform(), uniform()});
    const V3f local_origin = frame.to_local(ray.origin - centre), local = frame.to_local(ray.direction);
    const V3f at = local_origin - local * (local_origin.z / local.z);
    hits += std::fabs(at.x) < side / 2 && std::fabs(at.y) < side / 2;
  }
  const double found = hits / kRays * kWidth * kHeight;
  double expected = 0;
  constexpr int kPoints = 200000;
  for (int n = 0; n < kPoints; ++n) {
    const V3f point = centre + frame.to_world({(uniform() - 0.5f) * side, (uniform() - 0.5f) * side, 0});
    const CameraConnection c = importance_.connect(point, {uniform(), uniform()});
    if (c.density == 0) continue;
    expected += c.pdf_area(std::fabs(dot(frame.n, c.direction)), importance_.finite()) * side * side / kPoints;
  }
  const double deviation = double(kWidth) * kHeight * std::sqrt(hits) / kRays;
  EXPECT_NEAR(found, expected, 4 * deviation + 0.003 * expected);
  EXPECT_GT(hits, 500);
}

TEST_P(CameraImportanceOf, WhatIsBehindOrBesideIsNotSeen) {
  const CameraRay middle = camera_.generate_ray(kWidth / 2, kHeight / 2, {0.5f, 0.5f}, {0.5f, 0.5f});
  EXPECT_EQ(importance_.connect(middle.origin - middle.direction * 3.0f, {0.5f, 0.5f}).density, 0);
  const Frame frame(middle.direction);
  EXPECT_EQ(importance_.connect(middle.origin + middle.direction + frame.s * 1e3f, {0.5f, 0.5f}).density, 0);
  EXPECT_EQ(importance_.density(-middle.direction), 0);
}

INSTANTIATE_TEST_SUITE_P(Cameras, CameraImportanceOf,
                         testing::Values(Kind{Projection::perspective, 0}, Kind{Projection::perspective, 0.3},
                                         Kind{Projection::orthographic, 0}, Kind{Projection::orthographic, 0.2}));

// Every pixel's share is the density with which it samples the point, so over all points of the film each pixel's
// shares add up to one.
TEST(CameraImportance, SharesOfAFilterAreItsDensity) {
  for (const PixelFilterKind kind : {PixelFilterKind::box, PixelFilterKind::tent, PixelFilterKind::gaussian}) {
    PixelFilter filter;
    filter.kind = kind;
    filter.scale = 0.7;
    constexpr int kSide = 9, kSteps = 90;
    const Camera camera(pose_of(Projection::perspective, 0), kSide, kSide, {0, 0, 0}, filter);
    const CameraImportance importance(camera);
    std::vector<double> sums(kSide * kSide, 0.0);
    for (int j = 0; j < kSide * kSteps; ++j) {
      for (int i = 0; i < kSide * kSteps; ++i) {
        importance.for_each_pixel((i + 0.5) / kSteps, (j + 0.5) / kSteps, [&](int x, int y, double share) {
          ASSERT_TRUE(x >= 0 && x < kSide && y >= 0 && y < kSide);
          sums[std::size_t(y * kSide + x)] += share / (double(kSteps) * kSteps);
        });
      }
    }
    for (const double sum : sums) EXPECT_NEAR(sum, 1, 2e-3);
  }
}

// Rings of equal area and sectors of the lens get equally many rays, all of which meet in the plane of focus.
TEST(CameraLens, IsCoveredEvenly) {
  constexpr double kRadius = 0.2, kFocus = 4;
  constexpr int kRings = 10, kSectors = 20;
  std::mt19937 generator(6);
  const auto uniform = [&] { return std::uniform_real_distribution<float>(0, 1)(generator); };
  for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
    const CameraPose pose = pose_of(projection, kRadius);
    const Camera camera(pose, kWidth, kHeight, {1, -2, 0.5});
    const CameraRay middle = camera.generate_ray(20, 9, {0.3f, 0.6f}, {0.5f, 0.5f});
    const V3f right(pose.right), up(pose.up), forward(pose.forward);
    const auto focused = [&](const CameraRay& ray) {
      return ray.origin + ray.direction * float(kFocus / dot(ray.direction, forward));
    };
    std::vector<double> observed(kRings * kSectors),
        expected(observed.size(), double(test::kChiSquareSamples) / (kRings * kSectors));
    for (int n = 0; n < test::kChiSquareSamples; ++n) {
      const CameraRay ray = camera.generate_ray(20, 9, {0.3f, 0.6f}, {uniform(), uniform()});
      const V3f off = ray.origin - middle.origin;
      const double x = double(dot(off, right)) / kRadius, y = double(dot(off, up)) / kRadius, share = x * x + y * y;
      ASSERT_LT(share, 1 + 1e-4);
      const int ring = std::min(int(share * kRings), kRings - 1);
      const double turn = std::atan2(y, x) / (2 * std::numbers::pi) + 0.5;
      ++observed[std::size_t(ring * kSectors + std::min(int(turn * kSectors), kSectors - 1))];
      if (n % 100 != 0) continue;
      ASSERT_NEAR(length(focused(ray) - focused(middle)), 0, 1e-4);
    }
    const test::ChiSquareResult result = test::chi_square_test(observed, expected);
    EXPECT_TRUE(result.passes(test::kSignificance, 2)) << int(projection) << ": " << result.summary();
  }
}

}  // namespace
}  // namespace helio
