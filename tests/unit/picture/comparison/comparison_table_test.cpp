// From units to points and sentences.
#include "renderer/comparison/comparison_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/unit/picture/comparison/draws.h"
#include "tests/unit/picture/comparison/table_text.h"

namespace helio {
namespace {

using test::all;
using test::together;

ComparedUnit unit(const std::string& mode, int seed, std::uint32_t budget, std::uint32_t view, double seconds,
                  std::vector<MeasuredValue> values) {
  ComparedUnit result;
  result.mode = mode;
  result.seed_number = std::uint32_t(seed);
  result.budget = budget;
  result.view = view;
  result.seconds = seconds;
  result.samples = 1 << budget;
  result.values = std::move(values);
  return result;
}

// Modes of errors 1, 0.5, 0.25, ... times a factor, seeds within 10 % of these.
std::vector<ComparedUnit> units_of(const std::string& mode, int seeds, double seconds, double factor,
                                   double outlier_share = 0.01) {
  std::vector<ComparedUnit> units;
  for (int seed = 1; seed <= seeds; ++seed) {
    for (std::uint32_t budget = 0; budget < 3; ++budget) {
      const double error = factor * (1 + 0.02 * (seed - (seeds + 1) / 2.0)) / (1 << budget);
      units.push_back(unit(mode, seed, budget, 0, seconds * (1 << budget) * (1 + 0.001 * seed),
                           {{Measure::relmse, "", error},
                            {Measure::relmse, kDarkHalf, 2 * error},
                            {Measure::outlier_share, "", outlier_share},
                            {Measure::bias, "", 0.001 * (seed - (seeds + 1) / 2.0)}}));
    }
  }
  return units;
}

ComparisonScript still(std::vector<std::string> modes) {
  ComparisonScript script;
  script.modes = std::move(modes);
  script.budgets = {1, 2, 4};
  return script;
}

TEST(ComparisonTable, HasPointsInTheOrderOfTheScript) {
  std::vector<ComparedUnit> units = together(units_of("vcm", 5, 2, 0.25), units_of("pt", 5, 1, 1));
  std::reverse(units.begin(), units.end());
  units.push_back(unit("unknown", 1, 0, 0, 1, {}));
  units.push_back(unit("pt", 1, 7, 0, 1, {}));
  units.push_back(unit("pt", 1, 0, 3, 1, {}));
  units[0].disturbed = true;
  const ComparisonTable table = compare_units(still({"pt", "vcm"}), units);
  ASSERT_EQ(table.points.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const ComparedPoint& point = table.points[i];
    EXPECT_EQ(point.mode, i < 3 ? "pt" : "vcm");
    EXPECT_EQ(point.budget, i % 3);
    EXPECT_EQ(point.view, std::optional(0u));
    EXPECT_EQ(point.seeds, 5u);
    EXPECT_EQ(point.samples, 1 << i % 3);
    ASSERT_EQ(point.values.size(), 4u);
    EXPECT_EQ(point.values[0].measure, Measure::relmse);
    EXPECT_EQ(point.values[1].region, kDarkHalf);
    EXPECT_NEAR(point.values[0].value.mean, (i < 3 ? 1 : 0.25) / (1 << i % 3), 1e-12);
    EXPECT_TRUE(point.values[0].value.known);
  }
  EXPECT_SAYS(table, "1 picture was disturbed by other programs: 1 of pt.");
}

TEST(ComparisonTable, CountsTheFirstOfSeveralEqualUnits) {
  std::vector<ComparedUnit> units = units_of("pt", 5, 1, 1);
  units.push_back(unit("pt", 3, 0, 0, 1, {{Measure::relmse, "", 1e9}}));
  const ComparisonTable table = compare_units(still({"pt"}), units);
  EXPECT_EQ(table.points[0].seeds, 5u);
  EXPECT_NEAR(table.points[0].values[0].value.mean, 1, 1e-12);
}

// Three views; flicker from the second on. Seed 6 lacks a view, so it counts for the views alone.
TEST(ComparisonTable, OfAPathHasMeansOverItsViews) {
  ComparisonScript script = still({"pt"});
  script.views = 3;
  script.budgets = {1};
  std::vector<ComparedUnit> units;
  for (int seed = 1; seed <= 6; ++seed) {
    for (std::uint32_t view = 0; view < 3; ++view) {
      if (seed == 6 && view == 2) continue;
      std::vector<MeasuredValue> values = {{Measure::relmse, "", double(seed + view)}};
      if (view > 0) values.push_back({Measure::flicker, "", 10.0 * seed + view});
      units.push_back(unit("pt", seed, 0, view, 1 + view, values));
    }
  }
  const ComparisonTable table = compare_units(script, units);
  ASSERT_EQ(table.points.size(), 4u);
  EXPECT_EQ(table.points[0].seeds, 6u);
  EXPECT_EQ(table.points[2].seeds, 5u);
  const ComparedPoint& path = table.points[3];
  EXPECT_FALSE(path.view.has_value());
  EXPECT_EQ(path.seeds, 5u);
  EXPECT_DOUBLE_EQ(path.seconds.mean, 2);
  ASSERT_EQ(path.values.size(), 2u);
  EXPECT_NEAR(path.values[0].value.mean, 3 + 1, 1e-12);
  EXPECT_NEAR(path.values[1].value.mean, 30 + 1.5, 1e-12);
}

TEST(ComparisonSentences, TellWhoIsBestAndByHowMuch) {
  // vcm: a quarter of the error in twice the time: at equal time one half.
  const ComparisonTable table =
      compare_units(still({"pt", "vcm"}), together(units_of("pt", 5, 1, 1), units_of("vcm", 5, 2, 0.25)));
  EXPECT_SAYS(table, "After 4 samples per pixel vcm has the lowest relative MSE among 2 modes: 0.0625 (95 %: ");
  EXPECT_SAYS(table, "The next is pt: vcm has 0.25 of that of pt (95 %: 0.2");
  EXPECT_SAYS(table, "vcm is faster than pt to the relative MSE 0.25: 2 times as fast (95 %: 1.");
  EXPECT_SAYS(table, "s vcm's relative MSE is 0.5 of that of pt (95 %: 0.4");
  EXPECT_SAYS(table, "4 samples per pixel take vcm 2 times as long as pt (95 %: ");
  EXPECT_SAYS(table, "In the same time vcm is, against pt, better in relative MSE in the dark half.");
  EXPECT_SAYS_NOTHING_OF(table, "A few pixels");
  EXPECT_SAYS_NOTHING_OF(table, "disturbed");
  EXPECT_SAYS_NOTHING_OF(table, "differs from that of the reference");
}

TEST(ComparisonTable, HasIntervalsOfWhatIsPossible) {
  std::vector<ComparedUnit> units;
  for (int seed = 1; seed <= 5; ++seed) {
    const double high = seed == 1 ? 0.1 : 0.99, low = seed == 1 ? 0.9 : 0;
    units.push_back(unit("pt", seed, 0, 0, 1,
                         {{Measure::flip, "", high},
                          {Measure::outlier_share, "", low},
                          {Measure::dssim, "", 5 * low},
                          {Measure::mse, "", low}}));
  }
  const ComparisonTable table = compare_units(still({"pt"}), units);
  for (const ComparedPoint::Value& value : table.points[0].values) {
    EXPECT_TRUE(value.value.known);
    EXPECT_EQ(value.value.low < 0, value.measure == Measure::mse) << to_string(value.measure);
    if (value.measure == Measure::flip) {
      EXPECT_EQ(value.value.high, 1);
    }
  }
}

// Pictures of common seeds that are the same.
TEST(ComparisonSentences, TellWhatIsEqual) {
  ComparisonScript script = still({"pt", "adaptive", "vcm"});
  script.common_seeds = true;
  std::vector<ComparedUnit> units =
      together(units_of("pt", 5, 1, 1), together(units_of("adaptive", 5, 1, 1), units_of("vcm", 5, 2, 4)));
  for (ComparedUnit& u : units) {
    if (u.mode == "adaptive") u.seconds *= 1 + 0.01 * ((u.seed_number * 7 + u.budget) % 5 - 2.0);
  }
  const ComparisonTable table = compare_units(script, units);
  EXPECT_SAYS(table, "After 4 samples per pixel the relative MSE of pt and adaptive is the same in every seed: 0.25 (");
  EXPECT_SAYS(table, ", the lowest among 3 modes.");
  EXPECT_SAYS(table, "fter 4 samples per pixel adaptive's relative MSE is that of pt in every seed; 4 samples");
  EXPECT_SAYS_NOTHING_OF(table, "1 times that of");
  EXPECT_SAYS_NOTHING_OF(table, "Which of adaptive and pt has the lower");

  script.modes = {"pt", "adaptive"};
  const ComparisonTable two = compare_units(script, units);
  EXPECT_SAYS(two, "of pt and adaptive is the same in every seed: 0.25 (95 %: ");
  EXPECT_SAYS_NOTHING_OF(two, "the lowest");
}

TEST(ComparisonSentences, DecideNothingThatAFewPixelsDecide) {
  const ComparisonTable table =
      compare_units(still({"pt", "vcm"}), together(units_of("pt", 5, 1, 1), units_of("vcm", 5, 1, 0.25, 0.7)));
  EXPECT_SAYS(table, "That it is lower than the next is undecided, a few pixels decide it: it is 0.25 of that of pt");
  EXPECT_SAYS(table, "Which of vcm and pt has the lower relative MSE is undecided, a few pixels decide it: ");
  EXPECT_SAYS(table, "A few pixels decide vcm's relative MSE at 1, 2 and 4 samples per pixel");
  EXPECT_SAYS_NOTHING_OF(table, "faster");
}

TEST(ComparisonSentences, TellWhoseTimesAreOfDifferentCalls) {
  std::vector<ComparedUnit> units = together(units_of("pt", 5, 1, 1), units_of("vcm", 5, 2, 0.25));
  EXPECT_SAYS_NOTHING_OF(compare_units(still({"pt", "vcm"}), units), "calls");
  for (ComparedUnit& u : units) u.call = u.mode == "pt" ? 3 : 4;
  const ComparisonTable table = compare_units(still({"pt", "vcm"}), units);
  EXPECT_SAYS(table,
              "Most pictures of vcm are not from the calls that rendered those of pt, with which they took no turns");
  EXPECT_SAYS(table, "is faster to the relative MSE 0.25 is undecided, rendered by different calls: ");
  EXPECT_SAYS(table, "4 samples per pixel take vcm 2 times as long as pt (95 %: ");
  EXPECT_SAYS(table, "The next is pt: vcm has 0.25 of that of pt") << "of equal samples";
}

// 2 to 2.4 % by the seeds; its reference may be off by 2 %.
TEST(ComparisonSentences, CountTheNoiseOfTheReferenceInTheBias) {
  std::vector<ComparedUnit> units = units_of("pt", 5, 1, 1);
  const auto told = [&](double reference_error) {
    for (ComparedUnit& u : units) {
      u.values[3].value = 0.02 + 0.001 * u.seed_number;
      u.values[3].reference_error = reference_error;
    }
    return compare_units(still({"pt"}), units);
  };
  EXPECT_SAYS(told(0), "by more than the seeds explain: pt by 2.3 % (95 %: 2.");
  EXPECT_SAYS(told(0), "; the noise of the reference is not known, and not counted.");
  EXPECT_SAYS(told(0.002), "by more than the seeds and the noise of the reference explain: pt by 2.3 % (95 %: 1.");
  EXPECT_SAYS_NOTHING_OF(told(0.02), "differs from that of the reference");

  // References of a path's views are independent.
  ComparisonScript path = still({"pt"});
  path.views = 4;
  std::vector<ComparedUnit> of_path;
  for (std::uint32_t view = 0; view < 4; ++view) {
    for (const ComparedUnit& u : units) {
      of_path.push_back(u);
      of_path.back().view = view;
      for (MeasuredValue& value : of_path.back().values) value.value = value.measure == Measure::bias ? 0.01 : 1;
    }
  }
  const ComparisonTable table = compare_units(path, of_path);
  for (const ComparedPoint& point : table.points) {
    const double error = 0.02 / (point.view ? 1 : 2);
    for (const ComparedPoint::Value& value : point.values) {
      if (value.measure == Measure::bias) {
        EXPECT_NEAR(value.value.high, 0.01 + 1.959964 * error, 1e-9);
      }
    }
  }
}

TEST(ComparisonSentences, TellLossesAsPlainly) {
  const ComparisonTable table =
      compare_units(still({"vcm", "pt"}), together(units_of("pt", 5, 1, 1), units_of("vcm", 5, 2, 0.25)));
  EXPECT_SAYS(table, "pt is slower than vcm to the relative MSE 0.25: it takes 2 times as long (95 %: ");
  EXPECT_SAYS(table, "s pt's relative MSE is 2 times that of vcm (95 %: ");
  EXPECT_SAYS(table, "worse in relative MSE in the dark half");
  EXPECT_SAYS(table, "4 samples per pixel take pt 0.5 of the time of vcm (95 %: ");
}

TEST(ComparisonSentences, TellWhatIsUndecided) {
  const ComparisonTable table =
      compare_units(still({"pt", "bdpt"}), together(units_of("pt", 5, 1, 1), units_of("bdpt", 5, 1, 0.99)));
  EXPECT_SAYS(table, "That it is lower than the next is undecided: it is 0.99 of that of pt");
  EXPECT_SAYS(
      table,
      "Which of bdpt and pt has the lower relative MSE is undecided, as are all other measures: in 4.01 s bdpt's "
      "relative MSE is 0.99 of that of pt (95 %: 0.9");
  EXPECT_SAYS(table, "; 4 samples per pixel take bdpt 1 times as long as pt (95 %: 0.99");
  EXPECT_EQ(table.sentences.size(), 2u) << all(table);  // the best, and bdpt
}

TEST(ComparisonSentences, TellWhatLimitsTheAnswers) {
  std::vector<ComparedUnit> units = together(units_of("pt", 3, 1, 1, 0.7), units_of("vcm", 5, 100, 0.01));
  for (ComparedUnit& u : units) {
    if (u.mode != "vcm") continue;
    if (u.budget == 2) u.values[0].value = (u.seed_number - 3.2) * 1e-6;
    u.values[3].value = 0.02 + 0.001 * u.seed_number;
  }
  const ComparisonTable table = compare_units(still({"pt", "vcm"}), units);
  EXPECT_SAYS(table,
              "A few pixels decide pt's relative MSE at 1, 2 and 4 samples per pixel: on average 0.1 % of the pixels "
              "have 70 % of a picture's squared relative error at the last, and other seeds may come to quite another "
              "mean.");
  EXPECT_SAYS(
      table,
      "The reference does not resolve vcm's relative MSE at 4 samples per pixel: less the reference's own noise");
  EXPECT_SAYS(table, "At some budgets there are too few seeds, 3 of pt: below 5 seeds there are no intervals");
  EXPECT_SAYS(table, "; their curves have no error and no time in common.");
  EXPECT_SAYS(table, "explain: vcm by 2.3 % (95 %: ");
  for (const ComparedRatio& ratio : table.ratios) EXPECT_EQ(ratio.verdict, Verdict::undecided);
}

// Decided at equal samples, while the curves have nothing in common.
TEST(ComparisonSentences, TellThatCurvesHaveNothingInCommon) {
  const ComparisonTable table =
      compare_units(still({"pt", "vcm"}), together(units_of("pt", 5, 1, 1), units_of("vcm", 5, 100, 0.01)));
  EXPECT_SAYS(table,
              "vcm and pt are compared neither at equal error nor at equal time: their curves of the relative MSE have "
              "no error and no time in common.");
  EXPECT_SAYS(table, "After 4 samples per pixel vcm's relative MSE is 0.01 of that of pt (95 %: ");
}

// Two values are told of together where both have the finding at the same budgets, and apart where not.
TEST(ComparisonSentences, GroupFindingsOverMeasuresAndRegions) {
  std::vector<ComparedUnit> units = together(units_of("pt", 5, 1, 1), units_of("vcm", 5, 1, 1));
  for (ComparedUnit& u : units) {
    const bool first = u.budget == 0, of_both = u.mode == "pt";
    if (u.budget < 2) u.values[0].value = (u.seed_number - 3.2) * 1e-6;
    if (first || of_both) u.values[1].value = u.budget < 2 ? (u.seed_number - 3.2) * 1e-6 : u.values[1].value;
  }
  const ComparisonTable table = compare_units(still({"pt", "vcm"}), units);
  EXPECT_SAYS(
      table,
      "The reference does not resolve pt's relative MSE in the whole picture and the dark half at 1 and 2 samples "
      "per pixel; errors of vcm at 1 and 2 samples per pixel (relative MSE in the whole picture and the dark "
      "half): less");
}

// Twelve modes that differ in all they can: some 60 values each, of few seeds, with spikes and unresolved errors.
TEST(ComparisonSentences, AreFew) {
  for (const int modes : {2, 8, 12}) {
    test::Draws draws(17);
    ComparisonScript script = still({});
    std::vector<ComparedUnit> units;
    for (int mode = 0; mode < modes; ++mode) {
      const std::string name = "mode" + std::to_string(mode);
      script.modes.push_back(name);
      for (int seed = 1; seed <= (mode == 1 ? 4 : 10); ++seed) {
        for (std::uint32_t budget = 0; budget < 3; ++budget) {
          std::vector<MeasuredValue> values;
          for (const char* region : {"", kDarkHalf, "window", "lamp"}) {
            for (const Measure measure : {Measure::mse, Measure::relmse, Measure::bias, Measure::outlier_share}) {
              const double error = draws.log_normal(0.2) * (1 + 0.3 * mode) / (1 << budget);
              const bool unresolved = measure == Measure::mse && budget == 2 && mode % 2 == 0;
              values.push_back({measure, region,
                                unresolved                          ? draws.normal() * 1e-6
                                : measure == Measure::outlier_share ? 0.3 + 0.05 * mode
                                                                    : error});
            }
          }
          for (const Measure measure : {Measure::distance_variance, Measure::dssim, Measure::flip, Measure::hdr_flip})
            values.push_back({measure, "", draws.log_normal(1) / (1 << budget)});
          units.push_back(unit(name, seed, budget, 0, (1 << budget) * draws.log_normal(0.1), std::move(values)));
          units.back().disturbed = seed == 1;
        }
      }
    }
    const ComparisonTable table = compare_units(script, units);
    EXPECT_LE(table.sentences.size(), std::size_t(12 + 3 * modes)) << all(table);
    for (int mode = 1; mode < modes; ++mode) EXPECT_SAYS(table, "mode" + std::to_string(mode) + "'s relative MSE is ");
    RecordProperty("sentences of " + std::to_string(modes), std::to_string(table.sentences.size()));
  }
}

TEST(ComparisonSentences, AreThereWithoutAnyUnit) {
  EXPECT_SAYS(compare_units(still({"pt"}), {}), "There are no pictures to compare.");
  EXPECT_SAYS(compare_units(still({"pt", "vcm"}), units_of("pt", 5, 1, 1)), "There is no complete seed of vcm.");
  EXPECT_TRUE(compare_units({}, {}).points.empty());
}

TEST(ComparisonTable, HasNeitherNanNorInfinityOfExtremeValues) {
  const double extremes[] = {0, 5e-324, 1e-300, 1, 1e30, 1e300, -1e300};
  test::Draws draws(9);
  for (int run = 0; run < 200; ++run) {
    std::vector<ComparedUnit> units;
    const auto pick = [&] { return extremes[std::size_t(draws.uniform() * 6.99)]; };
    for (const char* mode : {"pt", "vcm"}) {
      for (int seed = 1; seed <= 6; ++seed) {
        for (std::uint32_t budget = 0; budget < 3; ++budget) {
          units.push_back(unit(mode, seed, budget, 0, std::abs(pick()), {{Measure::mse, "", pick()}}));
        }
      }
    }
    const ComparisonTable table = compare_units(still({"pt", "vcm"}), units);
    const auto finite = [](const Interval& i) {
      return std::isfinite(i.mean) && std::isfinite(i.low) && std::isfinite(i.high);
    };
    for (const ComparedPoint& point : table.points) {
      EXPECT_TRUE(finite(point.seconds));
      for (const ComparedPoint::Value& value : point.values) EXPECT_TRUE(finite(value.value));
    }
    for (const ComparedRatio& ratio : table.ratios) EXPECT_TRUE(finite(ratio.ratio) && std::isfinite(ratio.at));
    EXPECT_EQ(all(table).find("nan"), std::string::npos) << all(table);
    EXPECT_EQ(all(table).find("inf"), std::string::npos) << all(table);
  }
}

}  // namespace
}  // namespace helio
