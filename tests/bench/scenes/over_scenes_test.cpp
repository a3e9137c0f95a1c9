// Median and worst over scenes, and goals that are ranges.
#include "tests/bench/scenes/over_scenes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace helio::bench {
namespace {

Figure within(double value, double least, double most) {
  return {"f", value, "x", most, Better::within, least};
}

TEST(Figure, ARangeIsMissedOnBothSides) {
  EXPECT_FALSE(within(0.79, 0.8, 1.4).meets_goal());
  EXPECT_TRUE(within(0.8, 0.8, 1.4).meets_goal());
  EXPECT_TRUE(within(1.4, 0.8, 1.4).meets_goal());
  EXPECT_FALSE(within(1.41, 0.8, 1.4).meets_goal());
  EXPECT_FALSE(within(std::numeric_limits<double>::quiet_NaN(), 0.8, 1.4).meets_goal());
}

TEST(Figure, ARangeIsPrintedWithBothEnds) {
  Figures figures;
  figures.add(within(0.5, 0.8, 1.4));
  EXPECT_NE(figures.table().find("0.8 to 1.4  missed"), std::string::npos) << figures.table();
  EXPECT_NE(figures.json().find("\"goal\": 1.4"), std::string::npos) << figures.json();
  EXPECT_NE(figures.json().find("\"least\": 0.8"), std::string::npos) << figures.json();
}

TEST(OverScenes, TheWorstFollowsTheGoal) {
  const auto worst = [](std::vector<double> values, const Figure& figure) { return worst_of(values, figure); };
  EXPECT_EQ(worst({1, 3, 2}, {"f", 0, "x", 2.0, Better::lower}), 3);
  EXPECT_EQ(worst({1, 3, 2}, {"f", 0, "x", 2.0, Better::higher}), 1);
  // Half of what it is to be is worse than a quarter more: by factors, about the geometric middle of 1.06.
  EXPECT_EQ(worst({0.5, 1.0, 1.75}, within(0, 0.8, 1.4)), 0.5);
  EXPECT_EQ(worst({0.9, 1.0, 1.75}, within(0, 0.8, 1.4)), 1.75);
  EXPECT_EQ(worst({-0.3, 0.1, 0.25}, within(0, -0.2, 0.2)), -0.3);
  EXPECT_TRUE(std::isnan(worst({1, std::numeric_limits<double>::quiet_NaN()}, {"f", 0, "x", 2.0, Better::lower})));
}

TEST(OverScenes, PublishesMedianAndWorstWithTheirGoals) {
  OverScenes over_scenes;
  for (const double gain : {9.0, 1.5, 12.0}) over_scenes.add({"gain", gain, "x", 2.0, Better::higher}, 8.0);
  over_scenes.add({"of_one", 7, "%", std::nullopt, Better::lower});
  Figures figures;
  over_scenes.publish(figures);
  ASSERT_EQ(figures.items().size(), 4u);
  const Figure &median = figures.items()[0], &worst = figures.items()[1];
  EXPECT_EQ(median.name, "all.gain.median");
  EXPECT_EQ(median.value, 9);
  EXPECT_TRUE(median.meets_goal());
  EXPECT_EQ(median.goal, 8.0);
  EXPECT_EQ(worst.name, "all.gain.worst");
  EXPECT_EQ(worst.value, 1.5);
  EXPECT_EQ(worst.goal, 2.0);
  EXPECT_FALSE(worst.meets_goal());
  EXPECT_EQ(figures.items()[3].name, "all.of_one.worst");
  EXPECT_EQ(figures.items()[3].value, 7);
}

}  // namespace
}  // namespace helio::bench
