// Hard case 7: cameras in a wall, on a light, with the narrowest and the widest field of view.
#include <gtest/gtest.h>

#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr double kExpected = 1.75;  // three segments in a room that emits 1 and reflects a half

std::shared_ptr<const RenderScene> emitting_room() {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f), Rgb(1, 1, 1))};
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0, true));
  return build(std::move(scene));
}

MeanEstimate seen(const RenderScene& scene, const CameraPose& pose, TraceStats& stats) {
  PathSettings settings;
  settings.max_segments = 3;
  settings.roulette_from = 100;
  return mean_of(render(scene, pose, 32, 32, 32, settings, &stats));
}

// The room looks alike from everywhere, through every lens.
TEST(CameraPlace, NarrowestAndWidestFieldsOfView) {
  const auto room = emitting_room();
  for (const double fov : {0.1, 179.0}) {
    TraceStats stats;
    const MeanEstimate e = seen(*room, camera_at({0.2, 0.1, 0.3}, {1, 0.4, 0.2}, fov), stats);
    EXPECT_NEAR(e.mean.x, kExpected, 3 * e.standard_error.x + 1e-3) << fov;
    EXPECT_EQ(stats.invalid_samples, 0u);
  }
}

// A lamp across 0.37 of the width and height of what a lens is to see.
TEST(CameraPlace, FieldsOfViewAreAsWideAsTheySay) {
  for (const double fov : {0.1, 1.0, 60.0, 170.0, 179.0}) {
    const auto side = float(0.37 * std::tan(0.5 * fov * 3.14159265358979 / 180));
    SceneDescription scene;
    scene.materials = {lambert(Rgb(0, 0, 0), Rgb(1, 1, 1))};
    add_mesh(scene, quad({-side, -side, -1}, {2 * side, 0, 0}, {0, 2 * side, 0}, 0));
    TraceStats stats;
    const MeanEstimate e = seen(*build(std::move(scene)), camera_at({0, 0, 0}, {0, 0, -1}, fov), stats);
    EXPECT_NEAR(e.mean.x, 0.37 * 0.37, 5e-4) << fov;
    EXPECT_EQ(stats.invalid_samples, 0u);
  }
}

// On the wall, which here is a light, and in its corners, rays start in the plane of what they may hit: they see that
// at once (1, and less than the room reflects) or the room. No sample is invalid; the mean lies between the two.
TEST(CameraPlace, OnALightAndInACorner) {
  const auto room = emitting_room();
  for (const V3d& place : {V3d(-1, 0.1, 0.2), V3d(-1, -1, 0.2), V3d(-1, -1, -1)}) {
    TraceStats stats;
    const MeanEstimate e = seen(*room, camera_at(place, {0.9, 0.3, 0.1}, 60), stats);
    EXPECT_EQ(stats.invalid_samples, 0u);
    EXPECT_GE(e.mean.x, 1);
    EXPECT_LE(e.mean.x, kExpected + 3 * e.standard_error.x + 1e-3);
  }
}

// Inside a solid wall 0.2 thick whose both sides are black: all is black, and finite.
TEST(CameraPlace, InsideAWall) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0, 0, 0))};
  add_mesh(scene, box({-5, -5, -0.1f}, {5, 5, 0.1f}, 0));
  scene.environment = Environment{};
  TraceStats stats;
  EXPECT_EQ(seen(*build(std::move(scene)), camera_at({0, 0, 0}, {1, 0.1, 0.4}, 60), stats).mean.x, 0);
  EXPECT_EQ(stats.invalid_samples, 0u);
}

}  // namespace
}  // namespace helio::test
