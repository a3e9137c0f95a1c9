// The time at which a curve comes to an error, by hand.
#include "tests/bench/reports/error_curve.h"

#include <gtest/gtest.h>

namespace helio::bench {
namespace {

TEST(TimeTo, FollowsAPowerOfTimeBetweenTwoPoints) {
  const std::vector<CurvePoint> curve = {{1, 1, 1}, {4, 4, 0.25}, {16, 8, 0.125}};  // error = 1 / seconds
  for (const double seconds : {1.0, 2.0, 4.0, 5.0, 8.0}) {
    const auto found = time_to(curve, 1 / seconds);
    ASSERT_TRUE(found) << seconds;
    EXPECT_NEAR(*found, seconds, 1e-12);
  }
}

TEST(TimeTo, IsThatOfTheFirstFallToTheTarget) {
  const std::vector<CurvePoint> curve = {{1, 1, 1}, {2, 2, 0.5}, {4, 4, 1}, {8, 8, 0.5}};
  EXPECT_NEAR(time_to(curve, 0.5).value(), 2, 1e-12);
}

TEST(TimeTo, IsNothingWhereNoPointsEncloseTheTarget) {
  const std::vector<CurvePoint> curve = {{1, 1, 1}, {4, 4, 0.25}};
  EXPECT_FALSE(time_to(curve, 2));
  EXPECT_FALSE(time_to(curve, 0.2));
  EXPECT_FALSE(time_to({}, 1));
  EXPECT_FALSE(time_to({{1, 1, 1}}, 1));
  // A point that took no time, or no longer than the one before, is on no power of time.
  EXPECT_FALSE(time_to({{1, 0, 1}, {4, 4, 0.25}}, 0.5));
  EXPECT_FALSE(time_to({{1, 4, 1}, {4, 4, 0.25}}, 0.5));
}

}  // namespace
}  // namespace helio::bench
