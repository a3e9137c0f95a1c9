// Which level a number of samples can afford.
#include "renderer/film/core/level_steps.h"

#include <gtest/gtest.h>

#include <cmath>

namespace helio {
namespace {

TEST(LevelSteps, TheHighestLevelThatIsAffordable) {
  LevelSteps steps;
  steps.add_least(3);
  steps.add(0.5f, 2);
  steps.add(2, 10);
  steps.add(2.5f, 100);
  EXPECT_EQ(steps.least(), 3u);
  // Between the steps that it takes and the first that it does not, to a 64th of an octave.
  const auto some = steps.highest(20);
  EXPECT_EQ(some.samples, 15u);
  EXPECT_GT(some.level, 2);
  EXPECT_LE(some.level, 2.5);
  EXPECT_GT(some.level, 2.5 * std::exp2(-1.0 / 32));
  const auto exactly = steps.highest(5);
  EXPECT_EQ(exactly.samples, 5u);
  EXPECT_LE(exactly.level, 2);
  // Less than the least cannot be had.
  EXPECT_EQ(steps.highest(1).samples, 3u);
  EXPECT_LE(steps.highest(1).level, 0.5);
  EXPECT_EQ(steps.highest(1e9).samples, 115u);
  EXPECT_GT(steps.highest(1e9).level, 1e9);
}

TEST(LevelSteps, ExtremesCountAtTheEnds) {
  LevelSteps steps;
  steps.add(0, 1);
  steps.add(1e-38f, 1);
  steps.add(3e38f, 4);
  EXPECT_EQ(steps.highest(2).samples, 2u);
  EXPECT_EQ(steps.highest(0).samples, 0u);
  LevelSteps twice = steps;
  twice.add(steps);
  EXPECT_EQ(twice.highest(4).samples, 4u);
}

}  // namespace
}  // namespace helio
