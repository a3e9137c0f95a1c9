#include "renderer/film/core/sample_targets.h"

#include <gtest/gtest.h>

#include <cmath>

namespace helio::test {
namespace {

TEST(SampleTargets, AreBytesOfPowersOfTwo) {
  SampleTargets targets(3, 2, false);
  EXPECT_EQ(targets.target(0, 2, 1), 0u);
  for (const std::uint32_t count : {0u, 1u, 2u, 64u, 1u << 30, 1u << 31}) {
    targets.set_target(1, 2, 1, count);
    EXPECT_EQ(targets.target(1, 2, 1), count);
  }
  EXPECT_EQ(targets.target(0, 2, 1), 0u);
  targets.set_target(1, 2, 1, 7);  // what a pixel has: no more is asked for
  EXPECT_EQ(targets.target(1, 2, 1), 4u);
  targets.set_target(1, 2, 1, ~0u);
  EXPECT_EQ(targets.target(1, 2, 1), 1u << 31);
  targets.uniform = 100;
  targets.set_uniform(1, 2, 1);
  EXPECT_EQ(targets.target(1, 2, 1), 100u);
}

TEST(SampleTargets, ExactOnesAreAnyNumber) {
  SampleTargets targets(3, 2, true);
  targets.set_target(0, 1, 0, 16'777'217);
  EXPECT_EQ(targets.target(0, 1, 0), 16'777'217u);
}

TEST(SampleTargets, DemandIsKeptToAThousandthOfAnOctave) {
  SampleTargets targets(1, 1, false);
  for (const float demand : {0.0f, 1.0f, -45.0f, 45.0f, 0.3333f, -12.3456f}) {
    targets.set_demand(0, 0, 0, demand);
    EXPECT_NEAR(targets.demand(0, 0, 0), demand, 0.001) << demand;
  }
  targets.set_demand(0, 0, 0, std::nanf(""));
  EXPECT_TRUE(std::isnan(targets.demand(0, 0, 0)));
  targets.set_demand(0, 0, 0, -INFINITY);
  EXPECT_NEAR(targets.demand(0, 0, 0), -64, 0.01);
  targets.set_demand(0, 0, 0, INFINITY);
  EXPECT_NEAR(targets.demand(0, 0, 0), 64, 0.01);
}

}  // namespace
}  // namespace helio::test
