#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "client/camera_motion.h"
#include "client/camera_path.h"
#include "client/named_paths.h"

namespace helio::test {
namespace {

namespace pb = heliograph::v1;

// At (0, 0, 3), looking along -z.
PathStart start() {
  PathStart start;
  start.camera.mutable_position()->set_z(3);
  start.camera.mutable_rotation()->set_w(1);
  start.camera.set_vertical_fov(0.8);
  pb::SceneCamera camera;
  camera.set_name("side");
  camera.mutable_view()->mutable_position()->set_x(5);
  camera.mutable_view()->mutable_look_at()->mutable_target();
  start.cameras.push_back(camera);
  return start;
}

V3d position_of(const pb::CameraView& view) {
  return {view.position().x(), view.position().y(), view.position().z()};
}

void expect_near(const V3d& found, const V3d& wanted) {
  EXPECT_NEAR(found.x, wanted.x, 1e-12);
  EXPECT_NEAR(found.y, wanted.y, 1e-12);
  EXPECT_NEAR(found.z, wanted.z, 1e-12);
}

std::vector<PathView> play(const std::string& json) {
  auto views = parse_camera_path(json, "p.json", start());
  EXPECT_TRUE(views) << views.error().to_string();
  return views ? *views : std::vector<PathView>();
}

std::string refusal(const std::string& json) {
  const auto views = parse_camera_path(json, "p.json", start());
  return views ? "accepted" : views.error().to_string();
}

TEST(CameraMotion, AQuarterTurnLeftLooksAlongMinusX) {
  const CameraFrame frame = turned(*camera_frame(start().camera), 90);
  expect_near(frame.position, V3d(0, 0, 3));
  expect_near(frame.forward, V3d(-1, 0, 0));
  expect_near(frame.up, V3d(0, 1, 0));
}

TEST(CameraMotion, AnOrbitKeepsThePivotInSight) {
  // From +z, counter-clockwise seen from above: a quarter brings the camera to +x, looking back at the pivot.
  const CameraFrame frame = orbited(*camera_frame(start().camera), V3d(0, 0, 0), 90);
  expect_near(frame.position, V3d(3, 0, 0));
  expect_near(frame.forward, V3d(-1, 0, 0));
}

TEST(CameraMotion, MovesAlongItsOwnAxes) {
  const CameraFrame frame = moved(turned(*camera_frame(start().camera), 90), V3d(1, 2, 4));
  // Looking along -x, right is -z.
  expect_near(frame.position, V3d(-4, 2, 2));
}

TEST(CameraMotion, AQuaternionIsTheOrientationItSays) {
  pb::CameraView view = start().camera;
  // A quarter about +x turns the view from -z to +y and the up vector from +y to +z.
  view.mutable_rotation()->set_x(std::sqrt(0.5));
  view.mutable_rotation()->set_w(std::sqrt(0.5));
  const auto frame = camera_frame(view);
  ASSERT_TRUE(frame);
  expect_near(frame->forward, V3d(0, 1, 0));
  expect_near(frame->up, V3d(0, 0, 1));
}

TEST(CameraMotion, TwoHalvesMakeTheWhole) {
  const CameraFrame frame = *camera_frame(start().camera);
  const V3d pivot(1, 2, -1);
  const CameraFrame twice = orbited(orbited(frame, pivot, 20), pivot, 20), once = orbited(frame, pivot, 40);
  expect_near(twice.position, once.position);
  expect_near(twice.forward, once.forward);
}

// What a mouse does in a minute: 1,000 moves of each kind, out and back, end where they began.
TEST(CameraMotion, AThousandTinyMovesOutAndBackDoNotDrift) {
  const CameraFrame begin{{0.1, 2, 3}, V3d(1, -2, -3) / std::sqrt(14), V3d(1, 5, -3) / std::sqrt(35)};
  CameraFrame frame = begin;
  for (int i = 0; i < 1000; ++i) {
    const double sign = i < 500 ? 1 : -1;
    frame = moved(orbited(turned(frame, 0), {0, 0, 0}, 0), V3d(0.01, -0.02, 0.03) * sign);
  }
  for (int i = 0; i < 1000; ++i) frame = turned(frame, i < 500 ? 0.07 : -0.07);
  for (int i = 0; i < 1000; ++i) frame = orbited(frame, {0.5, 0, -1}, i < 500 ? 0.05 : -0.05);
  const auto expect_close = [](const V3d& found, const V3d& wanted) {
    EXPECT_LT(length(found - wanted), 1e-11) << found.x << ' ' << found.y << ' ' << found.z;
  };
  expect_close(frame.position, begin.position);
  expect_close(frame.forward, begin.forward);
  expect_close(frame.up, begin.up);
  EXPECT_NEAR(length(frame.forward), 1, 1e-12);
  EXPECT_NEAR(dot(frame.forward, frame.up), 0, 1e-12);
}

TEST(CameraMotion, RefusesViewsWithoutAFrame) {
  pb::CameraView named;
  named.set_scene_camera("side");
  EXPECT_FALSE(camera_frame(named));
  EXPECT_FALSE(camera_frame(pb::CameraView()));
  pb::CameraView aimless;
  aimless.mutable_position()->set_x(1);
  aimless.mutable_look_at()->mutable_target()->set_x(1);
  EXPECT_FALSE(camera_frame(aimless));
  pb::CameraView parallel;
  parallel.mutable_position();
  parallel.mutable_look_at()->mutable_target()->set_y(1);
  EXPECT_FALSE(camera_frame(parallel));  // the default up vector is (0, 1, 0)
  pb::CameraView nan = start().camera;
  nan.mutable_position()->set_y(std::nan(""));
  EXPECT_FALSE(camera_frame(nan));
}

TEST(CameraPath, AMotionPlaysTheStartAndEachStep) {
  CameraMotion motion;
  motion.orbit_degrees = 180;
  motion.steps = 2;
  const auto views = play_motion(motion, start());
  ASSERT_TRUE(views);
  ASSERT_EQ(views->size(), 3u);
  expect_near(position_of((*views)[0].camera), V3d(0, 0, 3));
  expect_near(position_of((*views)[1].camera), V3d(3, 0, 0));
  expect_near(position_of((*views)[2].camera), V3d(0, 0, -3));
  EXPECT_EQ((*views)[2].camera.vertical_fov(), 0.8);
}

TEST(CameraPath, ViewsFollowEachOther) {
  const auto views = play(R"({"views": [
    {"samples": 256},
    {"turn_degrees": 45, "repeat": 2, "samples": 64},
    {"camera": "side", "error": 0.5},
    {"camera": "0", "time_s": 2},
    {"position": [0, 1, 0], "target": [0, 1, -7], "fov_degrees": 90},
    {"move": [0, 0, 2]}]})");
  ASSERT_EQ(views.size(), 7u);
  EXPECT_EQ(views[0].budget->samples(), 256u);
  expect_near(camera_frame(views[2].camera)->forward, V3d(-1, 0, 0));
  EXPECT_EQ(views[2].budget->samples(), 64u);
  expect_near(position_of(views[3].camera), V3d(5, 0, 0));
  EXPECT_EQ(views[3].budget->error(), 0.5);
  EXPECT_EQ(views[4].budget->time_s(), 2);
  EXPECT_FALSE(views[5].budget);
  EXPECT_NEAR(views[6].camera.vertical_fov(), std::numbers::pi / 2, 1e-12);
  expect_near(position_of(views[6].camera), V3d(0, 1, -2));
}

TEST(CameraPath, EveryProblemIsNamedWithItsPlace) {
  const std::string text = refusal(R"({"views": [{"turn_degrees": "left"}, {"fov_degrees": 0, "zoom": 2},
    {"samples": 0, "repeat": 1.5}, {"camera": "top"}, {"camera": "side", "turn_degrees": 1}, 7,
    {"position": [1, 2]}, {"up": [0, 1, 0]}, {"lens_radius": -1}, {"error": 0}], "frames": 1})");
  for (const char* part :
       {"p.json/views/0/turn_degrees: \"left\"", "p.json/views/1/fov_degrees: 0 is not a number in [0.1, 179]",
        "p.json/views/1/zoom: is not a key", "p.json/views/2/samples: 0", "p.json/views/2/repeat: 1.5",
        "p.json/views/3/camera: 'top' is none of 'side'", "p.json/views/4/turn_degrees", "p.json/views/5: 7",
        "p.json/views/6/position: [1,2]", "p.json/views/7/up", "p.json/views/8/lens_radius: -1",
        "p.json/views/9/error: 0", "p.json/frames"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in: " << text;
  }
}

TEST(CameraPath, RefusesWhatIsNoPath) {
  EXPECT_NE(refusal("{").find("p.json@"), std::string::npos);
  for (const char* json : {"[]", "{}", R"({"views": 3})", R"({"views": []})"}) {
    EXPECT_NE(refusal(json).find("\"views\""), std::string::npos) << json;
  }
  // 25 bytes before the number, 5 in it: the place is where the fault was seen.
  const std::string overflow = refusal(R"({"views":[{"fov_degrees":1e400}]})");
  EXPECT_NE(overflow.find("p.json@30: number overflow parsing '1e400'"), std::string::npos) << overflow;
  const std::string deep = refusal(R"({"views": [{"move": )" + std::string(1000000, '['));
  EXPECT_NE(deep.find("p.json: values are nested more than 16 deep"), std::string::npos) << deep;
  const std::string text = refusal("{\"views\": [{\"camera\": \"\xff\"}]}");
  EXPECT_NE(text.find("p.json@"), std::string::npos) << text;
  const std::string long_value = refusal(R"({"views": [{"move": ")" + std::string(100000, 'x') + R"("}]})");
  EXPECT_NE(long_value.find("xxx... is not three finite numbers"), std::string::npos);
  EXPECT_LT(long_value.size(), 200u);
  // A target at the camera's own position has no direction.
  EXPECT_NE(refusal(R"({"views": [{"target": [0, 0, 3]}]})").find("p.json/views/0: look_at.target"), std::string::npos);
  EXPECT_NE(refusal(R"({"views": [{"repeat": 100000}, {"repeat": 100000}, {"repeat": 100000}, {"repeat": 100000},
    {"repeat": 100000}, {"repeat": 100000}, {"repeat": 100000}, {"repeat": 100000}, {"repeat": 100000},
    {"repeat": 100000}, {"repeat": 100000}]})")
                .find("more than 1000000 views"),
            std::string::npos);
}

TEST(CameraPath, WhatLeadsTooFarIsRefusedBeforeAnythingIsPlayed) {
  const std::string path = refusal(R"({"views": [{"move": [1e30, 0, 0]},
    {"position": [0, 0, 3], "lens_radius": 1e30, "focus_distance": 1e300}]})");
  for (const char* part : {"p.json/views/0", "(1e+30, 0, 3)", "[-1e12, 1e12]", "p.json/views/1/lens_radius: 1e+30",
                           "[0, 1e12]", "p.json/views/1/focus_distance: 1e+300"}) {
    EXPECT_NE(path.find(part), std::string::npos) << part << ": " << path;
  }
  CameraMotion motion;
  motion.move = V3d(1e30, 0, 0);
  const auto moved_away = play_motion(motion, start());
  ASSERT_FALSE(moved_away);
  EXPECT_NE(moved_away.error().to_string().find("[-1e12, 1e12]"), std::string::npos) << moved_away.error().to_string();
}

std::vector<PathView> play(const std::string& name, double distance, const PathScale& scale = {},
                           const PathStart& from = start()) {
  const auto path = named_path(name, distance, scale);
  EXPECT_TRUE(path) << path.error().to_string();
  auto views = play_named_path(*path, from);
  EXPECT_TRUE(views) << views.error().to_string();
  return views ? *views : std::vector<PathView>();
}

TEST(NamedPaths, EndAtTheStartsOwnCamera) {
  for (const char* name : kPathNames) {
    EXPECT_TRUE(is_path_name(name));
    EXPECT_EQ(play(name, 3).back().camera.SerializeAsString(), start().camera.SerializeAsString()) << name;
  }
  EXPECT_FALSE(is_path_name("turn.json"));
}

TEST(NamedPaths, GoWhereTheySay) {
  const auto turn = play("turn", 3, {.step = 45, .steps = 2});
  ASSERT_EQ(turn.size(), 3u);
  expect_near(camera_frame(turn[0].camera)->forward, V3d(1, 0, 0));  // two turns of 45 degrees to the left before -z
  const auto orbit = play("orbit", 3, {.step = 90, .steps = 1});
  expect_near(position_of(orbit[0].camera), V3d(-3, 0, 0));  // around the point 3 ahead, the origin
  const auto translate = play("translate", 5);
  ASSERT_EQ(translate.size(), 2u);
  expect_near(position_of(translate[0].camera), V3d(-0.5, 0, 3));
  const auto out = play("out-and-back", 5, {.step = 0.1, .steps = 2});
  ASSERT_EQ(out.size(), 5u);
  expect_near(position_of(out[2].camera), V3d(1, 0, 3));
  EXPECT_EQ(out[1].camera.SerializeAsString(), out[3].camera.SerializeAsString());
  EXPECT_EQ(play("tiny-moves", 5).size(), 1001u);
}

TEST(NamedPaths, ZoomIsOfTheLens) {
  const auto zoom = play("zoom", 3, {.step = 2, .steps = 1});
  EXPECT_NEAR(std::tan(zoom[0].camera.vertical_fov() / 2), 2 * std::tan(0.4), 1e-12);
  expect_near(position_of(zoom[0].camera), V3d(0, 0, 3));
  PathStart flat = start();
  flat.camera.clear_vertical_fov();
  flat.camera.set_orthographic_half_height(3);
  EXPECT_DOUBLE_EQ(play("zoom", 3, {.step = 2, .steps = 1}, flat)[0].camera.orthographic_half_height(), 6);
}

TEST(NamedPaths, RefuseWhatTheyDoNotKnow) {
  const auto problem = [](const std::string& name, double distance, const PathScale& scale = {}) {
    const auto path = named_path(name, distance, scale);
    return path ? std::string("accepted") : path.error().to_string();
  };
  EXPECT_NE(problem("spiral", 1).find("'spiral' is none of turn, translate"), std::string::npos);
  EXPECT_NE(problem("turn", 0).find("distance: 0 is not finite and above 0"), std::string::npos);
  EXPECT_NE(problem("turn", std::nan("")).find("distance"), std::string::npos);
  const std::string both = problem("zoom", 1, {.step = 1, .steps = 0});
  EXPECT_NE(both.find("step: 1 is not a magnification in [0.01, 100], not 1"), std::string::npos) << both;
  EXPECT_NE(both.find("steps: 0 is not in [1, 100000]"), std::string::npos) << both;
  EXPECT_NE(problem("orbit", 1, {.step = 361}).find("[-360, 360]"), std::string::npos);
  EXPECT_NE(problem("jump", 1, {.step = std::nan("")}).find("step"), std::string::npos);
  EXPECT_NE(problem("translate", 1, {.step = 0}).find("share of the distance"), std::string::npos);
  const auto far = play_named_path(*named_path("translate", 1e12, {.step = 100}), start());
  EXPECT_FALSE(far);
}

// A gaze stays as it was until another is named.
TEST(CameraPath, GazesAreNamedAndStay) {
  const auto views = play(R"({"views": [{}, {"gaze": [10, -2.5], "repeat": 2}, {"turn_degrees": 1}, {"gaze": null}]})");
  ASSERT_EQ(views.size(), 5u);
  EXPECT_FALSE(views[0].gaze);
  for (const int i : {1, 2, 3}) {
    ASSERT_TRUE(views[std::size_t(i)].gaze);
    EXPECT_EQ(views[std::size_t(i)].gaze->x(), 10);
    EXPECT_EQ(views[std::size_t(i)].gaze->y(), -2.5);
  }
  EXPECT_FALSE(views[4].gaze);
  for (const char* bad : {"[1]", "[1, 2, 3]", "[1, \"a\"]", "[1, 2e6]", "7", "{}"}) {
    EXPECT_NE(refusal(std::string(R"({"views": [{"gaze": )") + bad + "}]}")
                  .find("p.json/views/0/gaze: "),
              std::string::npos)
        << bad;
  }
}

}  // namespace
}  // namespace helio::test
