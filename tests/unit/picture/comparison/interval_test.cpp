// Intervals for means over seeds: how often they hold the true mean, and values at the ends of the range of doubles.
#include "renderer/comparison/interval.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/unit/picture/comparison/draws.h"

namespace helio {
namespace {

using test::Draws;

constexpr int kRuns = 1000;

struct Errors {
  std::string name;
  double mean;
  std::function<double(Draws&)> draw;
};

const Errors kNormal[] = {
    {"normal, mean 0", 0, [](Draws& d) { return d.normal(); }},
    {"normal, deviation 5 % of the mean", 1, [](Draws& d) { return d.normal(1, 0.05); }},
    {"normal, 30 %", 1, [](Draws& d) { return d.normal(1, 0.3); }},
    {"normal, 50 %", 1, [](Draws& d) { return d.normal(1, 0.5); }},
};
const Errors kLogNormal = {"log-normal, sigma 1", std::exp(0.5), [](Draws& d) { return d.log_normal(1); }};
const Errors kSum = {"normal plus log-normal", 1 + std::exp(0.5),
                     [](Draws& d) { return d.normal(1, 0.2) + d.log_normal(1); }};
const Errors kMixture = {"half normal, half log-normal", 0.5 + 0.5 * std::exp(0.5),
                         [](Draws& d) { return d.uniform() < 0.5 ? d.normal(1, 0.2) : d.log_normal(1); }};

// In what part of the runs the interval holds the true mean.
double coverage(const Errors& errors, int seeds) {
  Draws draws(20 + std::uint64_t(seeds));
  int held = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Interval interval = mean_interval(test::draw_many(seeds, [&] { return errors.draw(draws); }));
    EXPECT_TRUE(interval.known);
    EXPECT_LE(interval.low, interval.mean);
    EXPECT_GE(interval.high, interval.mean);
    held += interval.low <= errors.mean && errors.mean <= interval.high;
  }
  testing::Test::RecordProperty(errors.name + " " + std::to_string(seeds), std::to_string(held));
  return double(held) / kRuns;
}

TEST(ComparisonInterval, HoldsTheMeanOfNormalErrors) {
  for (const Errors& errors : kNormal) {
    for (const int seeds : {5, 8, 10, 20, 50}) {
      const double share = coverage(errors, seeds);
      EXPECT_GE(share, 0.92) << errors.name << ", " << seeds;
      EXPECT_LE(share, 0.98) << errors.name << ", " << seeds;
    }
  }
}

TEST(ComparisonInterval, HoldsTheMeanOfLogNormalErrors) {
  for (const int seeds : {8, 10, 20, 50}) {
    const double share = coverage(kLogNormal, seeds);
    EXPECT_GE(share, 0.92) << seeds;
    EXPECT_LE(share, 0.98) << seeds;
  }
  EXPECT_GE(coverage(kLogNormal, 5), 0.91);
}

// The header says that these are too narrow, and by how much.
TEST(ComparisonInterval, IsSomewhatNarrowForMixtures) {
  for (const Errors* errors : {&kSum, &kMixture}) {
    for (const int seeds : {5, 8, 10, 20, 50}) EXPECT_GE(coverage(*errors, seeds), 0.80) << errors->name << seeds;
  }
}

TEST(ComparisonInterval, IsStudentsForValuesOfSmallSpread) {
  // Mean 100, squares about it 4 + 1 + 0 + 1 + 4 = 10, standard error sqrt(10 / 4 / 5); 2.776445 for 4 degrees.
  const Interval interval = mean_interval(std::vector<double>{98, 99, 100, 101, 102});
  const double half = 2.776445 * std::sqrt(0.5);
  EXPECT_DOUBLE_EQ(interval.mean, 100);
  EXPECT_NEAR(interval.low, 100 - half, 0.03);
  EXPECT_NEAR(interval.high, 100 + half, 0.03);
}

TEST(ComparisonInterval, IsStudentsWhereAValueIsNotPositive) {
  // Mean 0, squares about it 10.
  const Interval interval = mean_interval(std::vector<double>{-2, -1, 0, 1, 2});
  EXPECT_DOUBLE_EQ(interval.mean, 0);
  EXPECT_NEAR(interval.low, -2.776445 * std::sqrt(0.5), 1e-5);
  EXPECT_NEAR(interval.high, 2.776445 * std::sqrt(0.5), 1e-5);
}

TEST(ComparisonInterval, IsNotKnownBelowFiveSeeds) {
  EXPECT_FALSE(mean_interval({}).known);
  for (int seeds = 1; seeds < 7; ++seeds) {
    std::vector<double> values;
    for (int i = 0; i < seeds; ++i) values.push_back(1 + i);
    const Interval interval = mean_interval(values);
    EXPECT_EQ(interval.known, seeds >= 5);
    EXPECT_DOUBLE_EQ(interval.mean, (1 + seeds) / 2.0);
    if (!interval.known) {
      EXPECT_EQ(interval.low, 0);
      EXPECT_EQ(interval.high, 0);
    }
  }
}

TEST(ComparisonInterval, OfEqualValuesHasNoWidth) {
  for (const double value : {0.0, -0.1, 0.1, 5e-324, 1e30, 1.7e308}) {
    const Interval interval = mean_interval(std::vector<double>(6, value));
    EXPECT_TRUE(interval.known);
    EXPECT_EQ(interval.mean, value);
    EXPECT_EQ(interval.low, value);
    EXPECT_EQ(interval.high, value);
  }
}

TEST(ComparisonInterval, IsCutToWhatIsPossible) {
  const Interval cut_low = cut({0.1, -0.2, 0.4, true}, 0, 1), cut_high = cut({0.9, 0.7, 1.1, true}, 0, 1);
  EXPECT_EQ(cut_low.low, 0);
  EXPECT_EQ(cut_low.high, 0.4);
  EXPECT_EQ(cut_high.low, 0.7);
  EXPECT_EQ(cut_high.high, 1);
  // A mean that rounding has put outside stays in its interval.
  const Interval rounded = cut({1 + 1e-15, 0.9, 1.1, true}, 0, 1);
  EXPECT_EQ(rounded.high, rounded.mean);
  const Interval unknown = cut({0.5}, 0.6, 1);
  EXPECT_FALSE(unknown.known);
  EXPECT_EQ(unknown.low, 0);
}

TEST(ComparisonInterval, IsWidenedByAnotherError) {
  const Interval wide = widened({1, 1 - 3, 1 + 8, true}, 4 / 1.959964);
  EXPECT_EQ(wide.mean, 1);
  EXPECT_NEAR(wide.low, 1 - 5, 1e-6);
  EXPECT_NEAR(wide.high, 1 + std::hypot(8, 4), 1e-6);
  EXPECT_EQ(widened({1}, 4).high, 0) << "not known";
}

TEST(ComparisonInterval, IsFiniteForAnyFiniteValues) {
  const std::vector<std::vector<double>> all = {
      {0, 0, 0, 0, 1e30},
      {1e-300, 1e30, 1, 1, 1},
      {5e-324, 1e-323, 5e-324, 5e-324, 1e-323},
      {1e308, 1.7e308, 1.5e308, 1e308, 1e308},
      {-1.7e308, 1.7e308, -1.7e308, 1.7e308, 0},
      {0, 5e-324, 0, 0, 0},
  };
  for (const std::vector<double>& values : all) {
    const Interval interval = mean_interval(values);
    EXPECT_TRUE(std::isfinite(interval.mean) && std::isfinite(interval.low) && std::isfinite(interval.high));
    if (interval.known) {
      EXPECT_LE(interval.low, interval.high);
    }
  }
}

}  // namespace
}  // namespace helio
