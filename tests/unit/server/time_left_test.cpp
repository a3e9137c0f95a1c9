// How long a job is said to take yet.
#include "server/jobs/time_left.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace helio::test {
namespace {

FrameProgress progress(double seconds, std::uint32_t samples, double error = 0) {
  FrameProgress progress;
  progress.seconds = seconds;
  progress.samples_per_pixel = samples;
  progress.error.known = error > 0;
  progress.error.rmse = error;
  return progress;
}

TEST(TimeLeft, IsUnknownBeforeSixteenSamples) {
  Budget budget;
  budget.samples = 100;
  EXPECT_FALSE(time_left(progress(1, 15), 1, budget, {}));
  EXPECT_TRUE(time_left(progress(1, 16), 1, budget, {}));
  budget = {};
  budget.error = 0.1;
  EXPECT_FALSE(time_left(progress(1, 64), 1, budget, {})) << "no error is known";
  EXPECT_FALSE(time_left(progress(1, 64), 1, Budget(), {})) << "no end is in sight";
  budget = {};
  budget.time_s = 10;
  const auto left = time_left(progress(4, 1), 1, budget, {});
  ASSERT_TRUE(left);
  EXPECT_DOUBLE_EQ(left->seconds, 6);
  EXPECT_DOUBLE_EQ(time_left(progress(11, 1), 1, budget, {})->seconds, 0);
}

TEST(TimeLeft, FollowsTheRateAndTheFirstEnd) {
  Budget budget;
  budget.samples = 300;
  EXPECT_NEAR(time_left(progress(2, 100), 1, budget, {})->seconds, 4, 1e-9);
  budget.time_s = 3;
  EXPECT_NEAR(time_left(progress(2, 100), 1, budget, {})->seconds, 1, 1e-9);
}

// A round of samples that is half done counts for the rate.
TEST(TimeLeft, TheRateIsThatOfAllSamples) {
  Budget budget;
  budget.samples = 320;
  FrameProgress running = progress(2, 32);
  EXPECT_NEAR(time_left(running, 100, budget, {})->seconds, 18, 1e-9);
  running.samples_per_second = 100 * 30;  // 60 of each pixel so far
  EXPECT_NEAR(time_left(running, 100, budget, {})->seconds, 288 / 30.0, 1e-9);
  running.samples_per_second = 100;  // an attempt that has just taken the picture up
  EXPECT_NEAR(time_left(running, 100, budget, {})->seconds, 18, 1e-9);
}

// Many points of a curve without noise are believed, few are not: the usual power is the guess.
TEST(TimeLeft, ExtrapolatesTheErrorsOwnPower) {
  for (const double power : {0.5, 0.7, 0.9}) {
    ErrorCurve curve;
    for (std::uint32_t n = 64; n <= 4096; n += 64) curve.add(progress(n, n, std::pow(n, -power)));
    Budget budget;
    budget.error = std::pow(65536, -power);
    const auto left = time_left(progress(4096, 4096), 1, budget, curve);
    ASSERT_TRUE(left);
    EXPECT_NEAR(left->seconds, 65536 - 4096, 0.25 * 65536) << power;
    EXPECT_LT(left->low_s, left->seconds);
    EXPECT_GT(left->high_s, left->seconds);
  }
  ErrorCurve few;
  few.add(progress(16, 16, 1));
  few.add(progress(20, 20, 0.8));  // n^-1
  Budget budget;
  budget.error = 0.1;
  EXPECT_GT(time_left(progress(20, 20), 1, budget, few)->seconds, 400);
  // Before anything is known of the curve the interval says so.
  const auto early = time_left(progress(20, 20), 1, budget, few);
  EXPECT_LT(early->low_s, 0.5 * early->seconds);
  EXPECT_GT(early->high_s, 2 * early->seconds);
}

TEST(TimeLeft, NothingOfACurveIsTooMuch) {
  ErrorCurve curve;
  for (const double error : {0.0, -1.0, std::nan(""), HUGE_VAL}) curve.add(progress(1, 32, error));
  EXPECT_TRUE(curve.points().empty());
  for (std::uint32_t n = 2; n < 1000; ++n) curve.add(progress(n, n, 1.0 / n));
  EXPECT_LE(curve.points().size(), 64u);
  Budget budget;
  budget.error = 1e-300;
  EXPECT_FALSE(time_left(progress(1000, 1000), 1, budget, curve)) << "longer than can be said";
}

// Of curves whose noise is what the interval allows for, and whose power changes by as much, four fifths end inside it:
// 0.8 of 1000 has a standard deviation of 0.013.
TEST(TimeLeft, ItsIntervalHoldsFourOfFive) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  int inside = 0;
  const int runs = 1000;
  for (int run = 0; run < runs; ++run) {
    const double power = std::clamp(0.65 + 0.1 * normal(random), 0.5, 1.0), pace = std::exp(0.1 * normal(random));
    ErrorCurve curve;
    for (std::uint32_t n = 16; n <= 64; n *= 2)
      curve.add(progress(n, n, std::pow(n, -power) * std::exp(0.08 * normal(random))));
    Budget budget;
    budget.error = std::pow(512, -power);
    const double true_left = (512 - 64) * pace;
    const auto left = time_left(progress(64, 64), 1, budget, curve);
    ASSERT_TRUE(left);
    inside += true_left >= left->low_s && true_left <= left->high_s ? 1 : 0;
  }
  EXPECT_GE(inside, 780) << "of " << runs;
  EXPECT_LE(inside, 950) << "so wide that it says nothing, of " << runs;
}

}  // namespace
}  // namespace helio::test
