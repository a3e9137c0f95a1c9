// Motion of what pixels show, against a plane whose positions are known in closed form.
#include "renderer/trace/gbuffer/previous_positions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kSide = 40;
constexpr double kFieldOfView = 60;  // degrees

// A wall at z = 0 that fills the view from (x, 0, 4), with a square before it, at z = 1, [-0.5, 0.5]^2.
std::shared_ptr<const RenderScene> wall_and_square() {
  SceneDescription description;
  description.materials = {Material()};
  add_mesh(description, quad({-50, -50, 0}, {100, 0, 0}, {0, 100, 0}, 0));
  add_mesh(description, quad({-0.5f, -0.5f, 1}, {1, 0, 0}, {0, 1, 0}, 0));
  return build(description);
}

CameraPose pose(double x, double z = 4) {
  return camera_at({x, 0, z}, {x, 0, 0}, kFieldOfView);
}

TEST(PreviousPositions, OfTheSameViewIsEachPixelsCentre) {
  const auto scene = wall_and_square();
  const FilmPositions same = previous_positions(*scene, pose(0), pose(0), kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const std::size_t i = std::size_t(y * kSide + x);
      EXPECT_NEAR(same.x[i], x + 0.5, 1e-3);
      EXPECT_NEAR(same.y[i], y + 0.5, 1e-3);
    }
  }
}

TEST(PreviousPositions, FollowSurfacesByTheirDistanceAndLeaveOutWhatWasHidden) {
  const auto scene = wall_and_square();
  // Pixels per unit at distance d.
  const auto scale = [](double d) { return kSide / (2 * std::tan(kFieldOfView / 2 * kPi / 180) * d); };
  const double step = 1;
  const FilmPositions moved = previous_positions(*scene, pose(0), pose(step), kSide, kSide);
  int hidden = 0, outside = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const std::size_t i = std::size_t(y * kSide + x);
      // The point at which the ray through the centre meets the square's plane, and whether it is in the square.
      const double square_x = step + (x + 0.5 - kSide / 2) / scale(3), square_y = (y + 0.5 - kSide / 2) / scale(3);
      const bool square = std::fabs(square_x) < 0.5 && std::fabs(square_y) < 0.5;
      const double was = x + 0.5 + step * scale(square ? 3 : 4);
      // The wall's point seen from the old view: behind the square?
      const double wall_x = step + (x + 0.5 - kSide / 2) / scale(4), wall_y = (y + 0.5 - kSide / 2) / scale(4);
      const bool covered = !square && std::fabs(wall_x * 3 / 4) < 0.5 && std::fabs(wall_y * 3 / 4) < 0.5;
      // Next to the square's edges the old pixel's centre may be the other surface.
      const double edge =
          std::min(std::fabs(std::fabs(wall_x * 3 / 4) - 0.5), std::fabs(std::fabs(wall_y * 3 / 4) - 0.5));
      if (!square && edge * scale(3) < 1) continue;
      if (was >= kSide) {
        EXPECT_TRUE(std::isnan(moved.x[i]));
        ++outside;
      } else if (covered) {
        EXPECT_TRUE(std::isnan(moved.x[i])) << x << ", " << y;
        ++hidden;
      } else if (!std::isnan(moved.x[i]) || !square) {
        EXPECT_NEAR(moved.x[i], was, 2e-3) << x << ", " << y;
        EXPECT_NEAR(moved.y[i], y + 0.5, 2e-3);
      }
    }
  }
  EXPECT_GT(hidden, 3);
  EXPECT_GT(outside, 3);
}

TEST(PreviousPositions, TheSkyIsFollowedByItsDirection) {
  SceneDescription description;
  description.materials = {Material()};
  add_mesh(description, quad({-50, -1, -50}, {0, 0, 100}, {100, 0, 0}, 0));
  const auto scene = build(description);
  const FilmPositions moved = previous_positions(*scene, camera_at({0, 0, 0}, {0, 0.4, -1}, kFieldOfView),
                                                 camera_at({3, 0, 0}, {3, 0.4, -1}, kFieldOfView), kSide, kSide);
  EXPECT_NEAR(moved.x[kSide / 2], kSide / 2 + 0.5, 1e-3) << "it does not move with the camera's place";
  EXPECT_NEAR(moved.y[kSide / 2], 0.5, 1e-3);
}

}  // namespace
}  // namespace helio::test
