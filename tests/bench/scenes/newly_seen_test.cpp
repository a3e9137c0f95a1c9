// What a move brings into view, where that can be calculated.
#include "tests/bench/scenes/newly_seen.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/bench/scenes/camera_paths.h"
#include "tests/support/small_rooms.h"
#include "tests/support/test_scenes.h"

namespace helio::bench {
namespace {

constexpr int kSide = 120;

TEST(NewlySeen, FollowsTheAngleOfATurn) {
  const auto room = test::build(test::lambert_room());
  const CameraPose home = test::camera_at({0.1, 0.1, 0.9}, {0, 0.1, -1}, 60);
  for (const double degrees : {1.0, 5.0, 20.0}) {
    ViewStep step;
    step.turn_degrees = degrees;
    // At the film's height of the horizon; above and below, the edge that comes in is a hyperbola about that line.
    const double half = 30 * std::numbers::pi / 180, left = half - degrees * std::numbers::pi / 180;
    const double expected = 0.5 * (1 - std::tan(left) / std::tan(half));
    const double share = newly_seen_share(*room, {moved(home, step, 1)}, home, kSide, kSide);
    EXPECT_NEAR(share, expected, 0.15 * expected + 1.5 / kSide) << degrees;
  }
}

TEST(NewlySeen, KnowsWhatWasSeenBeforeTheLastView) {
  const auto room = test::build(test::lambert_room());
  const CameraPose home = test::camera_at({0.1, 0.1, 0.9}, {0, 0.1, -1}, 60);
  ViewStep aside;
  aside.turn_degrees = 90;
  const CameraPose away = moved(home, aside, 1);
  EXPECT_GT(newly_seen_share(*room, {away}, home, kSide, kSide), 0.99);
  EXPECT_EQ(newly_seen_share(*room, {home, away}, home, kSide, kSide), 0);
  EXPECT_EQ(newly_seen_share(*room, {}, home, kSide, kSide), 1);
}

}  // namespace
}  // namespace helio::bench
