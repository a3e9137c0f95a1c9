// What comes before the last view of each motion.
#include "tests/bench/scenes/reuse_motions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace helio::bench {
namespace {

CameraPose home() {
  CameraPose pose;
  pose.position = V3d(0.1, 0.2, 0.9);
  return pose;
}

double degrees_aside(const CameraPose& pose) {
  return std::acos(std::clamp(dot(pose.forward, home().forward), -1.0, 1.0)) * 180 / std::numbers::pi;
}

TEST(ReuseMotion, ATurnIsOneStepFromARestAndAPathIsAllOfThem) {
  const auto turn = reuse_motion("turn-5", home(), 2), path = reuse_motion("path-20", home(), 2);
  ASSERT_TRUE(turn && path);
  ASSERT_EQ(turn->before.size(), 1u);
  EXPECT_NEAR(degrees_aside(turn->before[0].pose), 5, 1e-6);
  EXPECT_EQ(turn->before[0].samples, 256u);
  EXPECT_EQ(turn->goals.worst_gain, 2.0);
  ASSERT_EQ(path->before.size(), 5u);
  EXPECT_NEAR(degrees_aside(path->before.front().pose), 100, 1e-6);
  EXPECT_NEAR(degrees_aside(path->before.back().pose), 20, 1e-6);
  EXPECT_EQ(path->before[0].samples, 64u);
  EXPECT_FALSE(path->goals.share_of_ceiling);  // the goal is of steps of 5 degrees
  EXPECT_EQ(reuse_motion("path-5", home(), 2)->goals.share_of_ceiling, 70.0);
}

TEST(ReuseMotion, EveryNameIsOne) {
  for (const std::string& name : reuse_motion_names()) {
    const auto motion = reuse_motion(name, home(), 2);
    ASSERT_TRUE(motion) << name;
    EXPECT_EQ(motion->name, name);
    EXPECT_FALSE(motion->before.empty()) << name;
  }
  for (const std::string& name : default_reuse_motions()) EXPECT_TRUE(reuse_motion(name, home(), 2)) << name;
}

TEST(ReuseMotion, ThoseThatComeBackBeginWithARest) {
  const auto tiny = reuse_motion("tiny-moves", home(), 2);
  ASSERT_TRUE(tiny);
  ASSERT_EQ(tiny->before.size(), 1000u);
  EXPECT_EQ(tiny->before[0].pose.position, home().position);
  EXPECT_EQ(tiny->before[0].samples, 256u);
  EXPECT_EQ(tiny->before[1].samples, 1u);
  const auto translate = reuse_motion("translate", home(), 2);
  ASSERT_TRUE(translate);
  EXPECT_NEAR(length(translate->before.at(0).pose.position - home().position), 0.2, 1e-9);
  EXPECT_EQ(translate->before[0].samples, 256u);
}

TEST(ReuseMotion, StepsMayHaveOtherSamples) {
  for (const char* name : {"path-5", "orbit", "zoom", "out-and-back"}) {
    const auto fewer = reuse_motion(std::string(name) + "@32", home(), 2), plain = reuse_motion(name, home(), 2);
    ASSERT_TRUE(fewer && plain) << name;
    EXPECT_EQ(fewer->name, std::string(name) + "@32");
    ASSERT_EQ(fewer->before.size(), plain->before.size());
    EXPECT_EQ(fewer->before.back().samples, 32u);
    EXPECT_EQ(plain->before.back().samples, 64u);
    EXPECT_FALSE(fewer->goals.share_of_ceiling);  // the goal is of 64
  }
  for (const char* bad : {"path-5@", "path-5@0", "path-5@x", "orbit@32.5", "zoom@-1", "orbit@9999999", "turn-5@32",
                          "jump@32", "tiny-moves@2", "@32"}) {
    const auto motion = reuse_motion(bad, home(), 2);
    ASSERT_FALSE(motion) << bad;
    EXPECT_EQ(motion.error().code, ErrorCode::invalid_argument);
  }
}

TEST(ReuseMotion, UnknownNamesAreRefusedWithThoseThatThereAre) {
  for (const char* name : {"turn", "path-7", ""}) {
    const auto motion = reuse_motion(name, home(), 2);
    ASSERT_FALSE(motion) << name;
    EXPECT_EQ(motion.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(motion.error().to_string().find("out-and-back"), std::string::npos);
  }
}

}  // namespace
}  // namespace helio::bench
