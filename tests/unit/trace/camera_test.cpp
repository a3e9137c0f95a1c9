#include "renderer/trace/camera.h"

#include <gtest/gtest.h>

namespace helio {
namespace {

constexpr double kDegree = 3.14159265358979 / 180;

TEST(Camera, CentreLooksForwardAndEdgesSpanTheField) {
  const CameraPose pose = *look_at({1, 2, 3}, {1, 2, -7}, {0, 1, 0}, 60 * kDegree);
  const Camera camera(pose, 200, 100, {0, 0, 0});
  const CameraRay centre = camera.generate_ray({100, 50}, {0.5f, 0.5f});
  EXPECT_NEAR(centre.direction.z, -1, 1e-6);
  EXPECT_EQ(centre.origin, V3f(1, 2, 3));
  // Upper edge: half the vertical field above the axis. Right edge: twice its tangent, for an aspect of two.
  const CameraRay top = camera.generate_ray({100, 0}, {0.5f, 0.5f}),
                  right = camera.generate_ray({200, 50}, {0.5f, 0.5f});
  EXPECT_NEAR(top.direction.y / -top.direction.z, std::tan(30 * kDegree), 1e-6);
  EXPECT_NEAR(right.direction.x / -right.direction.z, 2 * std::tan(30 * kDegree), 1e-6);
}

TEST(Camera, IsRebasedWithTheScene) {
  const CameraPose pose = *look_at({1e7 + 0.25, 0, 0}, {1e7, 0, 0}, {0, 1, 0}, 1);
  EXPECT_EQ(Camera(pose, 8, 8, {1e7, 0, 0}).generate_ray({4, 4}, {0, 0}).origin, V3f(0.25f, 0, 0));
}

TEST(Camera, OrthographicRaysAreParallel) {
  CameraPose pose = *look_at({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 1);
  pose.projection = Projection::orthographic;
  pose.half_height = 2;
  const Camera camera(pose, 64, 32, {0, 0, 0});
  const CameraRay corner = camera.generate_ray({0, 0}, {0.5f, 0.5f});
  EXPECT_EQ(corner.direction, V3f(0, 0, -1));
  EXPECT_NEAR(corner.origin.x, -4, 1e-6);
  EXPECT_NEAR(corner.origin.y, 2, 1e-6);
}

// All rays of one film position meet in the plane of focus, wherever they leave the lens.
TEST(Camera, LensRaysMeetInFocus) {
  CameraPose pose = *look_at({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 50 * kDegree);
  pose.lens_radius = 0.1;
  pose.focus_distance = 4;
  const Camera camera(pose, 64, 64, {0, 0, 0});
  const auto at_focus = [&](const V2f& lens) {
    const CameraRay ray = camera.generate_ray({10, 20}, lens);
    EXPECT_LE(length(ray.origin), 0.1f * 1.0001f);
    return ray.origin + ray.direction * ((-4 - ray.origin.z) / ray.direction.z);
  };
  const V3f a = at_focus({0.1f, 0.9f}), b = at_focus({0.8f, 0.3f});
  EXPECT_LT(length(a - b), 1e-5f);
}

TEST(Camera, LookAtRefusesWhatHasNoOrientation) {
  EXPECT_NE(look_at({1, 1, 1}, {1, 1, 1}, {0, 1, 0}, 1).error().message.find("target"), std::string::npos);
  EXPECT_NE(look_at({0, 0, 0}, {0, 5, 0}, {0, 1, 0}, 1).error().message.find("up"), std::string::npos);
  EXPECT_FALSE(look_at({NAN, 0, 0}, {0, 0, 1}, {0, 1, 0}, 1).ok());
  EXPECT_FALSE(look_at({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 4).ok());
}

TEST(Camera, ValidationNamesEveryField) {
  CameraPose pose;
  pose.vertical_fov = 0;
  pose.lens_radius = -1;
  pose.focus_distance = INFINITY;
  pose.position.x = NAN;
  pose.right = V3d(0, 0, 0);
  Problems problems;
  validate(pose, "view.camera", problems);
  ASSERT_EQ(problems.size(), 5u);
  const std::string all = problems.to_error().message;
  for (const char* field : {"view.camera.position", "view.camera.rotation", "view.camera.vertical_fov",
                            "view.camera.lens_radius", "view.camera.focus_distance"}) {
    EXPECT_NE(all.find(field), std::string::npos) << field;
  }
}

}  // namespace
}  // namespace helio
