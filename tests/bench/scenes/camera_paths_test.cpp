// Camera paths: exact angles, exact returns, frames that stay orthonormal.
#include "tests/bench/scenes/camera_paths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "renderer/base/camera_limits.h"
#include "tests/bench/scenes/scene_depth.h"
#include "tests/support/test_scenes.h"

namespace helio::bench {
namespace {

constexpr double kDepth = 7.5;
constexpr double kRounding = 1e-15;  // a few units in the last place of 1

CameraPose tilted_view() {
  return test::camera_at({1.25, 2.5, -3.75}, {4, 1, 9}, 50);
}

double degrees_between(const V3d& a, const V3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
}

NamedPath path_of(const std::string& name) {
  auto path = find_camera_path(name, kDepth);
  EXPECT_TRUE(path.ok()) << name;
  return path.ok() ? *path : NamedPath{};
}

class EveryPath : public testing::TestWithParam<const char*> {};

TEST_P(EveryPath, EndsAtTheBitsOfTheScenesOwnView) {
  const CameraPose home = tilted_view();
  EXPECT_EQ(views_of(path_of(GetParam()), home).back(), home);
}

TEST_P(EveryPath, HoldsOrthonormalFramesInRange) {
  for (const CameraPose& view : views_of(path_of(GetParam()), tilted_view())) {
    EXPECT_NEAR(length(view.right), 1, kRounding);
    EXPECT_NEAR(length(view.up), 1, kRounding);
    EXPECT_NEAR(length(view.forward), 1, kRounding);
    EXPECT_NEAR(dot(view.right, view.up), 0, kRounding);
    EXPECT_NEAR(dot(view.right, view.forward), 0, kRounding);
    EXPECT_NEAR(dot(view.up, view.forward), 0, kRounding);
    EXPECT_GT(dot(cross(view.forward, view.up), view.right), 0.999) << "handedness";
    EXPECT_NEAR(view.right.y, 0, 1e-15) << "the horizon tilts";
    Problems problems;
    validate(view, "view", problems);
    EXPECT_TRUE(problems.empty());
  }
}

TEST_P(EveryPath, MovesAtEveryStep) {
  const std::vector<CameraPose> views = views_of(path_of(GetParam()), tilted_view());
  for (std::size_t i = 1; i < views.size(); ++i) EXPECT_NE(views[i], views[i - 1]) << i;
}

INSTANTIATE_TEST_SUITE_P(All, EveryPath,
                         testing::Values("turn-5", "turn-10", "turn-20", "turn-50", "translate", "orbit", "zoom",
                                         "out-and-back", "tiny-moves", "jump"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(CameraPaths, AreThoseThatAreTested) {
  EXPECT_EQ(camera_paths(kDepth).size(), 10u);
  const auto missing = find_camera_path("spiral", kDepth);
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().to_string().find("'spiral' is none of turn-5, turn-10"), std::string::npos);
}

TEST(CameraPaths, TurnsAreByTheAnglesOfTheirNames) {
  CameraPose level = test::camera_at({0, 1, 0}, {3, 1, 4});
  for (const int degrees : {5, 10, 20, 50}) {
    const auto views = views_of(path_of("turn-" + std::to_string(degrees)), level);
    ASSERT_EQ(views.size(), std::size_t(100 / degrees + 1));
    EXPECT_NEAR(degrees_between(views.front().forward, level.forward), 100, 1e-12);
    for (std::size_t i = 1; i < views.size(); ++i) {
      EXPECT_NEAR(degrees_between(views[i - 1].forward, views[i].forward), degrees, 1e-12);
      EXPECT_GT(cross(views[i - 1].forward, views[i].forward).y, 0) << "to the left";
      EXPECT_EQ(views[i].position, level.position);
    }
  }
}

TEST(CameraPaths, TranslationIsATenthOfTheDepthToTheRight) {
  const CameraPose home = tilted_view();
  const auto views = views_of(path_of("translate"), home);
  ASSERT_EQ(views.size(), 2u);
  const V3d way = views[1].position - views[0].position;
  EXPECT_NEAR(dot(way, home.right), 0.1 * kDepth, 1e-15);
  EXPECT_NEAR(length(way), 0.1 * kDepth, 1e-15);
  EXPECT_EQ(views[0].forward, home.forward);
}

// The pivot keeps its distance and its place in the middle of the picture.
TEST(CameraPaths, OrbitKeepsThePivotInTheMiddle) {
  const CameraPose home = tilted_view();
  const V3d pivot = home.position + home.forward * kDepth;
  for (const CameraPose& view : views_of(path_of("orbit"), home)) {
    EXPECT_NEAR(length(pivot - view.position), kDepth, 1e-14);
    EXPECT_NEAR(dot(normalize(pivot - view.position), view.forward), 1, 1e-15);
    EXPECT_NEAR(view.position.y, home.position.y, 1e-14);
  }
}

TEST(CameraPaths, ZoomHalvesTheTangentInEqualSteps) {
  const CameraPose home = tilted_view();
  const auto views = views_of(path_of("zoom"), home);
  ASSERT_EQ(views.size(), 5u);
  EXPECT_NEAR(std::tan(views[0].vertical_fov / 2), 2 * std::tan(home.vertical_fov / 2), 1e-14);
  for (std::size_t i = 1; i < views.size(); ++i) {
    EXPECT_NEAR(std::tan(views[i - 1].vertical_fov / 2) / std::tan(views[i].vertical_fov / 2), std::pow(2, 0.25),
                1e-14);
  }
  CameraPose flat = home;
  flat.projection = Projection::orthographic;
  flat.half_height = 3;
  EXPECT_DOUBLE_EQ(views_of(path_of("zoom"), flat)[0].half_height, 6);
}

TEST(CameraPaths, ZoomStaysInTheRangeOfLenses) {
  CameraPose home = tilted_view();
  home.vertical_fov = kMaxFov;
  EXPECT_EQ(moved(home, {.magnification = 2}, -10).vertical_fov, kMaxFov);
  EXPECT_EQ(moved(home, {.magnification = 2}, 1e6).vertical_fov, kMinFov);
  home.projection = Projection::orthographic;
  EXPECT_EQ(moved(home, {.magnification = 2}, 1e6).half_height, kMinCameraLength);
  EXPECT_EQ(moved(home, {.magnification = 2}, -1e6).half_height, kMaxCameraLength);
}

// There and back again, each view of the way back in the bits of the way out.
TEST(CameraPaths, TheWayBackIsTheWayOut) {
  const CameraPose home = tilted_view();
  for (const char* name : {"out-and-back", "tiny-moves"}) {
    const auto views = views_of(path_of(name), home);
    EXPECT_EQ(views.front(), home) << name;
    for (std::size_t i = 0; i < views.size(); ++i) EXPECT_EQ(views[i], views[views.size() - 1 - i]) << name << " " << i;
  }
  EXPECT_EQ(path_of("tiny-moves").amounts.size(), 1001u) << "1,000 moves";
  const V3d farthest = views_of(path_of("tiny-moves"), home)[500].position - home.position;
  EXPECT_NEAR(length(farthest), 0.1 * kDepth, 1e-14);
}

// A view straight down turns about its own up vector, and its frame stays whole.
TEST(CameraPaths, ViewsAlongTheVerticalTurnAboutTheirOwnUp) {
  const CameraPose down = test::camera_at({0, 5, 0}, {0, 0, 0});
  const CameraPose turned = moved(down, {.turn_degrees = 30}, 1);
  EXPECT_NEAR(degrees_between(down.forward, turned.forward), 30, 1e-12);
  EXPECT_NEAR(length(turned.up - down.up), 0, 1e-15);
}

// A wall that fills the picture, 3 units away: the mean of 3 sqrt(1 + u^2 + v^2) over the square |u|, |v| <= tan(20
// deg), 3 (1 + t^2 / 3 - t^4 (1 / 20 + 1 / 36) + ...) = 3.12785 with t = 0.36397 (third terms: t^6 (1 / 56 + 1 / 40)
// = 1.0e-4).
TEST(SceneDepth, IsTheMeanDistanceOfTheFirstHit) {
  SceneDescription scene;
  scene.materials = {test::lambert(Rgb(0.5f, 0.5f, 0.5f))};
  test::add_mesh(scene, test::quad({-5, -5, -3}, {10, 0, 0}, {0, 10, 0}, 0));
  const auto built = test::build(std::move(scene));
  ASSERT_TRUE(built);
  const double t2 = std::pow(std::tan(20 * std::numbers::pi / 180), 2);
  const double expected = 3 * (1 + t2 / 3 - t2 * t2 * (1 / 20.0 + 1 / 36.0) + t2 * t2 * t2 * (1 / 56.0 + 1 / 40.0));
  const auto depth = scene_depth(*built, test::camera_at({0, 0, 0}, {0, 0, -1}, 40));
  ASSERT_TRUE(depth.ok());
  EXPECT_NEAR(*depth, expected, 1e-3);
  EXPECT_FALSE(scene_depth(*built, test::camera_at({0, 0, 0}, {0, 0, 1}, 40)).ok()) << "nothing in sight";
}

}  // namespace
}  // namespace helio::bench
