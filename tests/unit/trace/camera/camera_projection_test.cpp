#include "renderer/trace/camera/camera_projection.h"

#include <gtest/gtest.h>

#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

TEST(CameraProjection, InvertsTheRaysOfTheCamera) {
  const V3d origin(3, -2, 5);
  CameraPose perspective = camera_at({4, 1, 9}, {0, 0.5, -1}, 65);
  CameraPose orthographic = perspective;
  orthographic.projection = Projection::orthographic;
  orthographic.half_height = 3;
  CameraPose skewed = perspective;  // as far from orthonormal as is allowed
  skewed.right += skewed.up * 9e-4;
  for (const CameraPose& pose : {perspective, orthographic, skewed}) {
    const Camera camera(pose, 301, 200, origin);
    const CameraProjection projection(pose, 301, 200, origin);
    for (const V2f& in_pixel : {V2f(0.5f, 0.5f), V2f(0, 0.25f)}) {
      for (const int x : {0, 17, 150, 300}) {
        for (const int y : {0, 99, 199}) {
          const CameraRay ray = camera.generate_ray(x, y, in_pixel, V2f(0.5f, 0.5f));
          const V3d position = V3d(ray.origin) + V3d(ray.direction) * 7.0;
          const FilmPoint p = projection.point(position);
          ASSERT_TRUE(p.in_front);
          EXPECT_NEAR(p.x, x + double(in_pixel.x), 1e-3);
          EXPECT_NEAR(p.y, y + double(in_pixel.y), 1e-3);
          const double depth = dot(V3d(ray.direction) * 7.0, pose.forward);
          EXPECT_NEAR(length(projection.position_at(p.x, p.y, depth) - position), 0, 2e-5 * 7);
          EXPECT_NEAR(p.footprint, projection.footprint(depth), 1e-4 * p.footprint);
          if (pose.projection == Projection::perspective) {
            const FilmPoint far = projection.direction(V3d(ray.direction));
            EXPECT_NEAR(far.x, p.x, 1e-6 * 301);
            EXPECT_NEAR(far.y, p.y, 1e-6 * 200);
          }
        }
      }
    }
  }
}

TEST(CameraProjection, WhatLiesBehindIsNotSeen) {
  const CameraPose pose = camera_at({0, 0, 4}, {0, 0, 0});
  const CameraProjection projection(pose, 10, 10, V3d(0, 0, 0));
  EXPECT_FALSE(projection.point({0, 0, 5}).in_front);
  EXPECT_FALSE(projection.point({0, 0, 4}).in_front);  // the camera itself
  EXPECT_FALSE(projection.direction({0, 0, 1}).in_front);
  EXPECT_TRUE(projection.point({0, 0, 0}).in_front);
}

}  // namespace
}  // namespace helio::test
