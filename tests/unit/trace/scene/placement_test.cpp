// Placements without an inverse: flat ones stay, with the normals of the plane; those that leave no area go.
#include "renderer/trace/scene/placement.h"

#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

M44d scaled(double x, double y, double z) {
  M44d m;
  m.setScale(V3d(x, y, z));
  return m;
}

V3d normal_of(const M44d& m, const V3f& n) {
  const V3d moved = Linear(m).normal_transform().apply(n);
  return moved / length(moved);
}

Object object_of(TriangleMesh mesh) {
  Object object;
  object.meshes.push_back(std::move(mesh));
  return object;
}

const Object kBox = object_of(box({-1, -1, -1}, {1, 1, 1}, 0));
const Object kSheet = object_of(quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0));  // at z = 0

TEST(Placement, FlatOnesGetAThicknessThatIsNotSeen) {
  M44d turn;
  turn.setAxisAngle(V3d(1, 2, 3) / std::sqrt(14.0), 0.7);
  for (const bool mirrored : {false, true}) {
    const M44d thick = *with_thickness(scaled(2, 3, 0) * turn, kBox, {0, 0, 0}, mirrored);
    EXPECT_TRUE(is_usable_transform(thick));
    EXPECT_EQ(Linear(thick).determinant() < 0, mirrored);
    // The plane's normal is the turned z, as of a scale of 2, 3 and a little above or below 0; so is that of a slope.
    const V3d wanted = V3d(0, 0, mirrored ? -1 : 1) * turn;
    for (const V3f& n : {V3f(0, 0, 1), V3f(0.6f, 0, 0.8f)})
      EXPECT_LT(length(normal_of(thick, n) - wanted), 1e-5) << mirrored;
    // Nothing moves by more than 1e-6 of the smaller side.
    EXPECT_LT(length(transform_point(thick, {1, 1, 1}) - transform_point(scaled(2, 3, 0) * turn, {1, 1, 1})), 3.1e-6);
  }
}

TEST(Placement, TheThicknessIsAroundWhatIsPlaced) {
  const V3d centre(0, 0, 1e6);
  const M44d thick = *with_thickness(scaled(1, 1, 0), kBox, centre, false);
  EXPECT_LT(length(transform_point(thick, centre)), 1e-9);
}

TEST(Placement, WhatLeavesNoAreaGoes) {
  EXPECT_FALSE(with_thickness(scaled(0, 0, 0), kBox, {0, 0, 0}, false));
  EXPECT_FALSE(with_thickness(scaled(0, 5, 0), kBox, {0, 0, 0}, false));
  EXPECT_FALSE(with_thickness(scaled(1, NAN, 0), kBox, {0, 0, 0}, false));
  EXPECT_TRUE(with_thickness(scaled(1e-20, 1e-20, 0), kBox, {0, 0, 0}, false));
  // A sheet pressed along itself is a line, along its normal it is the same sheet.
  EXPECT_FALSE(with_thickness(scaled(1, 0, 1), kSheet, {0, 0, 0}, false));
  EXPECT_TRUE(with_thickness(scaled(1, 1, 0), kSheet, {0, 0, 0}, false));
}

// As a whole scene: once, placed twice (not baked), and as a sphere.
TEST(Placement, FlatInstancesAreRendered) {
  for (const int count : {1, 2}) {
    for (const bool sphere : {false, true}) {
      SceneDescription scene;
      scene.materials.push_back(lambert(Rgb(0.5f)));
      Object ball;
      ball.spheres.push_back({{0, 0, 0}, 1, 0});
      scene.objects.push_back(sphere ? ball : kBox);
      for (int i = 0; i < count; ++i) {
        M44d to_world = scaled(1, 1, 0);
        to_world[3][0] = 4.0 * i;
        scene.instances.push_back({"flat", 0, to_world});
      }
      scene.instances.push_back({"gone", 0, scaled(0, 0, 0)});
      const auto built = RenderScene::build(std::move(scene), {});
      ASSERT_TRUE(built.ok()) << built.error().to_string();
      EXPECT_EQ((*built)->description().instances.size(), std::size_t(count));
      ASSERT_EQ((*built)->description().report.notices.size(), 1u);
      EXPECT_EQ((*built)->description().report.notices[0], "gone: its transform leaves it no area; not rendered");
      const Box3d bounds = (*built)->world_bounds();
      EXPECT_NEAR(bounds.max.x - bounds.min.x, 2 + 4.0 * (count - 1), 1e-3);
      EXPECT_LT(bounds.max.z - bounds.min.z, 1e-3);
    }
  }
}

}  // namespace
}  // namespace helio::test
