// Ratios between modes: values by hand, and how often intervals hold the true ratio.
#include "renderer/comparison/ratios.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/unit/picture/comparison/draws.h"

namespace helio {
namespace {

using test::Draws;

ComparisonScript two_modes(std::vector<double> budgets) {
  ComparisonScript script;
  script.modes = {"pt", "vcm"};
  script.budgets = std::move(budgets);
  return script;
}

ComparedUnit unit(const std::string& mode, int seed, std::uint32_t budget, double seconds, double error) {
  ComparedUnit result;
  result.mode = mode;
  result.seed_number = std::uint32_t(seed);
  result.budget = budget;
  result.seconds = seconds;
  result.values = {{Measure::mse, "", error}};
  return result;
}

std::vector<ComparedRatio> ratios_of(const ComparisonScript& script, const std::vector<ComparedUnit>& units) {
  return compare_modes(script, SeedTable(script, units), 1, 0);
}

std::vector<ComparedRatio> of_kind(const std::vector<ComparedRatio>& ratios, RatioKind kind) {
  std::vector<ComparedRatio> found;
  for (const ComparedRatio& ratio : ratios) {
    if (ratio.kind == kind) found.push_back(ratio);
  }
  return found;
}

// pt: error 8 / t at t = 1, 2, 4, 8. vcm: twice as slow a sample, error 4 / t^1 at t = 2, 4, 8, 16: half of it at any
// time, so that it is there in half the time. Seeds are 0.9 to 1.1 of these.
std::vector<ComparedUnit> half_the_error(double scale = 1) {
  std::vector<ComparedUnit> units;
  for (int seed = 1; seed <= 5; ++seed) {
    const double spread = 1 + 0.05 * (seed - 3);
    for (std::uint32_t budget = 0; budget < 4; ++budget) {
      const double t = std::pow(2.0, budget);
      units.push_back(unit("pt", seed, budget, t, scale * spread * 8 / t));
      units.push_back(unit("vcm", seed, budget, 2 * t, scale * spread * 4 / (2 * t)));
    }
  }
  return units;
}

TEST(ComparisonRatios, AreThoseOfTwoPowerLaws) {
  const ComparisonScript script = two_modes({1, 2, 4, 8});
  for (const double scale : {1.0, 1e30, 1e-30, 1e-300}) {
    const std::vector<ComparedRatio> ratios = ratios_of(script, half_the_error(scale));

    // vcm's errors are 2, 1, 0.5, 0.25 and pt's 8, 4, 2, 1: those that both have are 2 and 1.
    const auto equal_error = of_kind(ratios, RatioKind::equal_error);
    ASSERT_EQ(equal_error.size(), 2u);
    EXPECT_NEAR(equal_error[0].at, 2 * scale, 1e-12 * scale);
    EXPECT_NEAR(equal_error[1].at, 1 * scale, 1e-12 * scale);
    for (const ComparedRatio& ratio : equal_error) {
      EXPECT_NEAR(ratio.ratio.mean, 2, 1e-9);
      EXPECT_TRUE(ratio.ratio.known);
      EXPECT_EQ(ratio.verdict, Verdict::better);
    }

    // At 2, 4 and 8 s, of pt's times; vcm has none at 1 s.
    const auto equal_time = of_kind(ratios, RatioKind::equal_time);
    ASSERT_EQ(equal_time.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(equal_time[i].at, std::pow(2.0, double(i + 1)));
      EXPECT_NEAR(equal_time[i].ratio.mean, 0.5, 1e-9);
      EXPECT_EQ(equal_time[i].verdict, Verdict::better);
    }

    const auto equal_samples = of_kind(ratios, RatioKind::equal_samples);
    ASSERT_EQ(equal_samples.size(), 4u);
    for (const ComparedRatio& ratio : equal_samples) {
      EXPECT_NEAR(ratio.ratio.mean, 0.25, 1e-9);
      EXPECT_EQ(ratio.baseline, "pt");
      EXPECT_EQ(ratio.mode, "vcm");
      EXPECT_EQ(ratio.measure, Measure::mse);
    }

    const auto speed = of_kind(ratios, RatioKind::speed);
    ASSERT_EQ(speed.size(), 4u);
    for (const ComparedRatio& ratio : speed) {
      EXPECT_NEAR(ratio.ratio.mean, 2, 1e-9);
      EXPECT_EQ(ratio.verdict, Verdict::worse);
      EXPECT_NEAR(ratio.ratio.high, 2, 1e-9);  // all seeds took as long
    }
  }
}

TEST(ComparisonRatios, OfTimeBudgetsAreAtTheBudget) {
  ComparisonScript script = two_modes({1, 2});
  script.budgets_are_seconds = true;
  std::vector<ComparedUnit> units;
  for (int seed = 1; seed <= 5; ++seed) {
    for (std::uint32_t budget = 0; budget < 2; ++budget) {
      units.push_back(unit("pt", seed, budget, script.budgets[budget] * 1.01, 1 + 0.01 * seed));
      units.push_back(unit("vcm", seed, budget, script.budgets[budget] * 1.03, 2 * (1 + 0.01 * seed)));
    }
  }
  const auto ratios = ratios_of(script, units);
  ASSERT_EQ(ratios.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(ratios[i].kind, RatioKind::equal_time);
    EXPECT_EQ(ratios[i].at, script.budgets[i]);
    EXPECT_NEAR(ratios[i].ratio.mean, 2, 1e-9);
    EXPECT_EQ(ratios[i].verdict, Verdict::worse);
  }
}

TEST(ComparisonRatios, AreNeverExtrapolated) {
  const ComparisonScript script = two_modes({1, 2});
  std::vector<ComparedUnit> units;
  for (int seed = 1; seed <= 5; ++seed) {
    units.push_back(unit("pt", seed, 0, 1, 8));
    units.push_back(unit("pt", seed, 1, 2, 4));
    units.push_back(unit("vcm", seed, 0, 10, 3));
    units.push_back(unit("vcm", seed, 1, 20, 1.5));
  }
  const auto ratios = ratios_of(script, units);
  EXPECT_TRUE(of_kind(ratios, RatioKind::equal_error).empty());
  EXPECT_TRUE(of_kind(ratios, RatioKind::equal_time).empty());
  EXPECT_EQ(of_kind(ratios, RatioKind::equal_samples).size(), 2u);
}

TEST(ComparisonRatios, LeaveOutErrorsThatAreNotPositive) {
  const ComparisonScript script = two_modes({1, 2, 4, 8});
  std::vector<ComparedUnit> units = half_the_error();
  for (ComparedUnit& u : units) {
    if (u.budget == 2) u.values[0].value = -0.5;
    if (u.budget == 3) u.values[0].value = 0;
  }
  const auto ratios = ratios_of(script, units);
  EXPECT_EQ(of_kind(ratios, RatioKind::equal_samples).size(), 2u);
  for (const ComparedRatio& ratio : ratios) {
    EXPECT_TRUE(std::isfinite(ratio.ratio.mean) && std::isfinite(ratio.ratio.low) && std::isfinite(ratio.ratio.high));
    if (ratio.kind == RatioKind::equal_time) {
      EXPECT_LE(ratio.at, 4);
    }
  }
}

// A mean that is positive, but not without its third seed, has a ratio and no interval.
TEST(ComparisonRatios, HaveNoIntervalWhereTheMeanWithoutASeedIsNotPositive) {
  const ComparisonScript script = two_modes({1});
  std::vector<ComparedUnit> units;
  const double errors[] = {-1, -1, 10, -1, -1};
  for (int seed = 1; seed <= 5; ++seed) {
    units.push_back(unit("pt", seed, 0, 1, 1));
    units.push_back(unit("vcm", seed, 0, 1, errors[seed - 1]));
  }
  const auto ratios = of_kind(ratios_of(script, units), RatioKind::equal_samples);
  ASSERT_EQ(ratios.size(), 1u);
  EXPECT_NEAR(ratios[0].ratio.mean, 1.2, 1e-12);
  EXPECT_FALSE(ratios[0].ratio.known);
  EXPECT_EQ(ratios[0].verdict, Verdict::undecided);
}

TEST(ComparisonRatios, HaveNoIntervalBelowFiveSeeds) {
  std::vector<ComparedUnit> units = half_the_error();
  std::erase_if(units, [](const ComparedUnit& u) { return u.mode == "vcm" && u.seed_number == 5; });
  const auto ratios = ratios_of(two_modes({1, 2, 4, 8}), units);
  EXPECT_FALSE(ratios.empty());
  for (const ComparedRatio& ratio : ratios) {
    EXPECT_FALSE(ratio.ratio.known);
    EXPECT_EQ(ratio.verdict, Verdict::undecided);
  }
}

TEST(ComparisonRatios, OfTheSameNoiseAreOneWithoutWidth) {
  ComparisonScript script = two_modes({1, 2});
  script.common_seeds = true;
  Draws draws(5);
  std::vector<ComparedUnit> units;
  for (int seed = 1; seed <= 6; ++seed) {
    for (std::uint32_t budget = 0; budget < 2; ++budget) {
      const double error = draws.log_normal(1) / (1 + budget);
      units.push_back(unit("pt", seed, budget, 1 + budget + 0.1 * draws.uniform(), error));
      units.push_back(unit("vcm", seed, budget, 1 + budget + 0.1 * draws.uniform(), error));
    }
  }
  const auto ratios = of_kind(ratios_of(script, units), RatioKind::equal_samples);
  ASSERT_EQ(ratios.size(), 2u);
  for (const ComparedRatio& ratio : ratios) {
    EXPECT_EQ(ratio.ratio.mean, 1);
    EXPECT_EQ(ratio.ratio.low, 1);
    EXPECT_EQ(ratio.ratio.high, 1);
    EXPECT_EQ(ratio.verdict, Verdict::undecided);
  }
}

// Half the error at any time, in pictures of which some have most of it in a few pixels.
TEST(ComparisonRatios, ThatAFewPixelsDecideAreUndecided) {
  for (const std::string rare : {"pt", "vcm"}) {
    std::vector<ComparedUnit> units = half_the_error();
    for (ComparedUnit& u : units)
      u.values.push_back({Measure::outlier_share, "", u.mode == rare && u.budget == 3 ? 0.7 : 0.02});
    int decided = 0;
    for (const ComparedRatio& ratio : ratios_of(two_modes({1, 2, 4, 8}), units)) {
      if (ratio.kind == RatioKind::speed) {
        EXPECT_FALSE(ratio.few_pixels_decide);
        EXPECT_EQ(ratio.verdict, Verdict::worse);
        continue;
      }
      EXPECT_EQ(ratio.few_pixels_decide, ratio.verdict == Verdict::undecided);
      if (ratio.kind == RatioKind::equal_samples) {
        EXPECT_EQ(ratio.few_pixels_decide, ratio.at == 8);
      }
      decided += ratio.verdict == Verdict::better;
    }
    EXPECT_GE(decided, 4) << "of the points before";
    const auto lowest = of_kind(ratios_of(two_modes({1, 2, 4, 8}), units), RatioKind::equal_error).back();
    EXPECT_EQ(lowest.few_pixels_decide, rare == "pt") << "pt's last point; vcm is there between its first two";
  }
}

TEST(ComparisonRatios, OfTimesAreUndecidedBetweenModesThatTookNoTurns) {
  const auto apart = [](const std::function<std::uint32_t(const ComparedUnit&)>& call) {
    std::vector<ComparedUnit> units = half_the_error();
    for (ComparedUnit& u : units) u.call = call(u);
    int count = 0;
    for (const ComparedRatio& ratio : ratios_of(two_modes({1, 2, 4, 8}), units)) {
      if (ratio.kind == RatioKind::equal_samples) {
        EXPECT_FALSE(ratio.different_calls);
        EXPECT_EQ(ratio.verdict, Verdict::better);
        continue;
      }
      EXPECT_EQ(ratio.verdict == Verdict::undecided, ratio.different_calls);
      count += ratio.different_calls;
    }
    return count;
  };
  EXPECT_EQ(apart([](const ComparedUnit&) { return 0u; }), 0) << "not known of any";
  EXPECT_EQ(apart([](const ComparedUnit& u) { return u.seed_number < 4 ? 7u : 9u; }), 0) << "more seeds of both";
  EXPECT_EQ(apart([](const ComparedUnit& u) { return u.seed_number < (u.mode == "pt" ? 4u : 3u) ? 7u : 9u; }), 0)
      << "interrupted within a round";
  EXPECT_EQ(apart([](const ComparedUnit& u) { return u.mode == "pt" ? 0u : 9u; }), 4 + 3 + 2) << "added later";
  EXPECT_EQ(apart([](const ComparedUnit& u) { return u.seed_number < (u.mode == "pt" ? 5u : 3u) ? 7u : 9u; }),
            4 + 3 + 2);
}

// Two modes of the same errors and times: how often 1 lies in the interval. Of a seed, the error at a budget is the
// mean of as many independent parts, so that one picture grows from budget to budget.
struct Identical {
  std::string name;
  std::function<double(Draws&)> part;
  bool paired;
};

TEST(ComparisonRatios, OfIdenticalModesHoldOne) {
  const Identical cases[] = {
      {"normal 10 %", [](Draws& d) { return d.normal(1, 0.1); }, false},
      {"normal 30 %", [](Draws& d) { return std::max(0.01, d.normal(1, 0.3)); }, false},
      {"log-normal 0.5", [](Draws& d) { return d.log_normal(0.5); }, false},
      {"log-normal 1", [](Draws& d) { return d.log_normal(1); }, false},
      {"log-normal 0.5, paired", [](Draws& d) { return d.log_normal(0.5); }, true},
  };
  constexpr int kRuns = 1000;
  for (const Identical& errors : cases) {
    for (const int seeds : {5, 10}) {
      ComparisonScript script = two_modes({1, 2, 4});
      script.common_seeds = errors.paired;
      Draws draws(11);
      int known[4] = {}, held[4] = {};
      for (int run = 0; run < kRuns; ++run) {
        std::vector<ComparedUnit> units;
        for (const char* mode : {"pt", "vcm"}) {
          for (int seed = 1; seed <= seeds; ++seed) {
            double of_seed = errors.part(draws), seconds = 0;
            for (std::uint32_t budget = 0; budget < 3; ++budget) {
              seconds += (budget == 0 ? 1 : script.budgets[budget - 1]) * draws.log_normal(0.03);
              units.push_back(unit(mode, seed, budget, seconds, of_seed / script.budgets[budget]));
              of_seed = 0.7 * of_seed + 0.3 * errors.part(draws);
            }
          }
        }
        const auto ratios = ratios_of(script, units);
        for (const RatioKind kind :
             {RatioKind::equal_error, RatioKind::equal_time, RatioKind::equal_samples, RatioKind::speed}) {
          const auto all = of_kind(ratios, kind);
          if (all.empty() || !all.back().ratio.known) continue;
          ++known[int(kind)];
          held[int(kind)] += all.back().ratio.low <= 1 && all.back().ratio.high >= 1;
        }
      }
      const char* const names[] = {"equal error", "equal time", "equal samples", "speed"};
      for (int kind = 0; kind < 4; ++kind) {
        const double share = double(held[kind]) / known[kind];
        RecordProperty(errors.name + " " + std::to_string(seeds) + " " + names[kind],
                       std::to_string(share) + " of " + std::to_string(known[kind]));
        EXPECT_GE(known[kind], 600) << errors.name << seeds << names[kind];
        EXPECT_GE(share, 0.92) << errors.name << seeds << names[kind];
        EXPECT_LE(share, 0.98) << errors.name << seeds << names[kind];
      }
    }
  }
}

}  // namespace
}  // namespace helio
