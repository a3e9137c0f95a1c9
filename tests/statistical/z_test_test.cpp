// That the z-tests pass what is right and fail what is wrong.
#include "tests/statistical/z_test.h"

#include <gtest/gtest.h>

#include <random>

namespace helio::test {
namespace {

constexpr int kSide = 64;

Estimate noisy(double mean, double deviation, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(mean, deviation);
  Estimate e{kSide, kSide, {}, {}};
  for (int i = 0; i < kSide * kSide; ++i) {
    e.mean.push_back({noise(random), noise(random), noise(random)});
    e.variance.push_back(V3d(deviation * deviation));
  }
  return e;
}

TEST(ZTest, BoundOfOneTestIsTheNormalQuantile) {
  // The two-sided 5 % quantile of the standard normal distribution is 1.95996.
  EXPECT_NEAR(sidak_bound(0.05, 1), 1.95996, 1e-4);
  // 49,152 tests at 1 % together: each at 2.045e-7, whose quantile is 5.194.
  EXPECT_NEAR(sidak_bound(0.01, 49152), 5.194, 5e-3);
}

TEST(ZTest, PassesTwoEstimatesOfOnePicture) {
  EXPECT_TRUE(z_test(noisy(0.5, 0.05, 1), noisy(0.5, 0.02, 2)).passed());
}

TEST(ZTest, FailsWhenOneTileIsLost) {
  // One tile of sixteen black is more than 0.25 % of the pixels: both tests see it.
  Estimate broken = noisy(0.5, 0.05, 3);
  for (int y = 0; y < kTileSide; ++y)
    for (int x = 0; x < kTileSide; ++x) broken.mean[std::size_t(y * kSide + x)] = V3d(0, 0, 0);
  const ZTestResult result = z_test(broken, noisy(0.5, 0.02, 4));
  EXPECT_LT(result.pixels_inside, kLeastShare);
  EXPECT_GT(result.worst_tile, 1);
}

TEST(ZTest, TilesSeeABiasThatNoPixelShows) {
  // 3 % too bright: 0.015 against a deviation of 0.054 of a pixel, 0.0034 of a tile's mean.
  const ZTestResult result = z_test(noisy(0.515, 0.05, 5), noisy(0.5, 0.02, 6));
  EXPECT_GE(result.pixels_inside, kLeastShare);
  EXPECT_GT(result.worst_tile, 1);
}

// Pixels that are the means of 3 x 3 others: a sum of them has the deviation of a sum of those, three times as much as
// if they were independent.
TEST(ZTest, TilesKnowWhereNeighboursErrTogether) {
  Estimate reference = noisy(0, 0.06, 9);
  const std::vector<V3d> independent = reference.mean;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      V3d sum(0, 0, 0);
      for (int k = 0; k < 9; ++k) sum += independent[std::size_t((y + k / 3) % kSide * kSide + (x + k % 3) % kSide)];
      reference.mean[std::size_t(y * kSide + x)] = sum / 9.0;
      reference.variance[std::size_t(y * kSide + x)] = V3d(0.02 * 0.02);  // 0.06^2 / 9
    }
  }
  const std::vector<V3d> zeros(kSide * kSide, V3d(0, 0, 0));
  const Estimate exact{kSide, kSide, zeros, zeros};
  const double blind = z_test(exact, reference).worst_tile;
  reference.overlap = 9;
  const ZTestResult result = z_test(exact, reference);
  EXPECT_TRUE(result.passed()) << result.to_string();
  EXPECT_GT(blind, 1);
  EXPECT_NEAR(blind / result.worst_tile, 3, 1e-3);  // the relative floor counts a little
}

TEST(ZTest, NotANumberFails) {
  Estimate broken = noisy(0.5, 0.05, 7);
  broken.mean[5] = V3d(std::nan(""));
  EXPECT_FALSE(z_test(broken, noisy(0.5, 0.02, 8)).passed());
}

}  // namespace
}  // namespace helio::test
