// Comparisons along a path of cameras: which views means are over, and modes whose pictures are previews.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "renderer/comparison/comparison_table.h"
#include "tests/unit/picture/comparison/table_text.h"

namespace helio {
namespace {

using test::together;

constexpr std::uint32_t kViews = 4;

// Films of mode "pt" and previews of "move": at 1, 2 and 4 samples per pixel, seeds within 10 %.
// pt: 1, 2 and 4 s a view, errors of 1, 0.5 and 0.25; in its first view a hundred times that.
// move: a film of 50 s and of error 1e-3 first, then previews of 2 s and error 0.1 whatever the budget.
std::vector<ComparedUnit> units_of(const std::string& mode, bool previews, double preview_seconds = 2,
                                   double preview_error = 0.1) {
  std::vector<ComparedUnit> units;
  for (int seed = 1; seed <= 5; ++seed) {
    const double spread = 1 + 0.05 * (seed - 3);
    for (std::uint32_t budget = 0; budget < 3; ++budget) {
      for (std::uint32_t view = 0; view < kViews; ++view) {
        ComparedUnit unit;
        unit.mode = mode;
        unit.seed_number = std::uint32_t(seed);
        unit.budget = budget;
        unit.view = view;
        const double passes = 1 << budget;
        double error = 1 / passes;
        unit.seconds = unit.samples = passes;
        if (view == 0) error *= 100;
        if (previews) {
          unit.seconds = view == 0 ? 50 : preview_seconds;
          unit.samples = view == 0 ? passes : 1;
          error = view == 0 ? 1e-3 : preview_error;
        }
        unit.values = {{Measure::relmse, "", spread * error}};
        units.push_back(unit);
      }
    }
  }
  return units;
}

ComparisonScript path(std::vector<std::string> modes, std::vector<std::string> preview_modes) {
  ComparisonScript script;
  script.modes = std::move(modes);
  script.budgets = {1, 2, 4};
  script.views = kViews;
  script.preview_modes = std::move(preview_modes);
  return script;
}

const ComparedPoint* over_all_views(const ComparisonTable& table, const std::string& mode, std::uint32_t budget) {
  for (const ComparedPoint& point : table.points) {
    if (point.mode == mode && point.budget == budget && !point.view) return &point;
  }
  return nullptr;
}

TEST(ComparisonPreviews, HaveMeansWithoutTheFirstView) {
  const ComparisonTable table =
      compare_units(path({"pt", "move"}, {"move"}), together(units_of("pt", false), units_of("move", true)));
  for (std::uint32_t budget = 0; budget < 3; ++budget) {
    const ComparedPoint *films = over_all_views(table, "pt", budget), *previews = over_all_views(table, "move", budget);
    ASSERT_TRUE(films && previews);
    EXPECT_NEAR(previews->seconds.mean, 2, 1e-12);
    EXPECT_NEAR(previews->samples, 1, 1e-12);
    EXPECT_NEAR(previews->values[0].value.mean, 0.1, 1e-12);
    EXPECT_NEAR(films->seconds.mean, 1 << budget, 1e-12);
    EXPECT_NEAR(films->values[0].value.mean, (100 + 3) / 4.0 / (1 << budget), 1e-12);
  }
  EXPECT_EQ(table.points.size(), 2 * 3 * (kViews + 1));  // each view has its own points all the same
}

// pt's error after 2 s is 0.5 over views 2 to 4, five times that of the previews; with its first view it would be 12.9.
TEST(ComparisonPreviews, AreComparedAtEqualTimeOverTheSameViews) {
  const std::vector<ComparedUnit> units = together(units_of("pt", false), units_of("move", true));
  const ComparisonTable table = compare_units(path({"pt", "move"}, {"move"}), units);
  ASSERT_EQ(table.ratios.size(), 3u);
  for (const ComparedRatio& ratio : table.ratios) {
    EXPECT_EQ(ratio.kind, RatioKind::equal_time);
    EXPECT_NEAR(ratio.at, 2, 1e-12);
    EXPECT_NEAR(ratio.ratio.mean, 0.2, 1e-9);
    EXPECT_EQ(ratio.verdict, Verdict::better);
  }
  EXPECT_SAYS(table, "A preview of move takes 2 s on average and has the relative MSE 0.1 (95 %: ");
  EXPECT_SAYS(table,
              ", over views 2 to 4, after a first view of 4 samples per pixel; after the same time pt has 0.5, and "
              "move's is 0.2 of that (95 %: ");
  EXPECT_SAYS(table, "): better.");
  EXPECT_SAYS_NOTHING_OF(table, "4 samples per pixel take");
  EXPECT_SAYS_NOTHING_OF(table, "has the lowest");

  const ComparisonTable reversed = compare_units(path({"move", "pt"}, {"move"}), units);
  ASSERT_EQ(reversed.ratios.size(), 3u);
  EXPECT_NEAR(reversed.ratios[0].ratio.mean, 5, 1e-9);
  EXPECT_SAYS(reversed, "In 2 s pt's relative MSE is 5 times that of the previews of move, over views 2 to 4 (95 %: ");
  EXPECT_SAYS(reversed, "): worse.");
}

TEST(ComparisonPreviews, AreNotComparedOutsideTheCurve) {
  const ComparisonTable table =
      compare_units(path({"pt", "move"}, {"move"}), together(units_of("pt", false), units_of("move", true, 0.03)));
  EXPECT_TRUE(table.ratios.empty());
  EXPECT_SAYS(table, "A preview of move takes 0.03 s on average");
  EXPECT_SAYS(table, "; pt's curve does not enclose that time.");
}

TEST(ComparisonPreviews, OfTwoModesAreComparedWhereTheyTakeAsLong) {
  const ComparisonScript script = path({"a", "b"}, {"a", "b"});
  const ComparisonTable same = compare_units(script, together(units_of("a", true), units_of("b", true, 2.05, 0.3)));
  ASSERT_EQ(same.ratios.size(), 3u);
  EXPECT_NEAR(same.ratios[0].ratio.mean, 3, 1e-9);
  EXPECT_EQ(same.ratios[0].verdict, Verdict::worse);
  EXPECT_SAYS(same, "after the same time a has 0.1, and b's is 3 times that (95 %: ");
  const ComparisonTable other = compare_units(script, together(units_of("a", true), units_of("b", true, 3, 0.3)));
  EXPECT_TRUE(other.ratios.empty());
  EXPECT_SAYS(other, "; those of a do not take as long, and are not compared with it.");
}

// The other modes are compared over all views, as without a preview mode.
TEST(ComparisonPreviews, LeaveTheOtherModesAsTheyAre) {
  const std::vector<ComparedUnit> films = together(units_of("pt", false), units_of("vcm", false));
  const ComparisonTable without = compare_units(path({"pt", "vcm"}, {}), films);
  const ComparisonTable with =
      compare_units(path({"pt", "vcm", "move"}, {"move"}), together(films, units_of("move", true)));
  ASSERT_GT(with.ratios.size(), without.ratios.size());
  for (std::size_t i = 0; i < without.ratios.size(); ++i) {
    EXPECT_EQ(with.ratios[i].kind, without.ratios[i].kind);
    EXPECT_EQ(with.ratios[i].at, without.ratios[i].at);
    EXPECT_EQ(with.ratios[i].ratio.mean, without.ratios[i].ratio.mean);
  }
  EXPECT_SAYS(with, "has the lowest relative MSE among 2 modes: ");
}

TEST(ComparisonPaths, TellWhichViewsAMeanLeavesOut) {
  std::vector<ComparedUnit> units = units_of("pt", false);
  for (ComparedUnit& unit : units) {
    const double error = unit.values[0].value;
    unit.values.push_back({Measure::mse, "", error});
    if (unit.view > 0) unit.values.push_back({Measure::flicker, "", error});
    if (unit.view == 2) unit.values.erase(unit.values.begin());
  }
  const ComparisonTable table = compare_units(path({"pt"}, {}), units);
  EXPECT_NEAR(over_all_views(table, "pt", 0)->values[1].value.mean, (100 + 2) / 3.0, 1e-9);
  EXPECT_SAYS(
      table,
      "Where a value is not defined, as with a black reference, its view is left out: means of the relative MSE "
      "are over 3 of the 4 views, without view 3.");
  // A view without any picture is a seed that is not complete, and flicker starts with the second view.
  const ComparisonTable complete = compare_units(path({"pt"}, {}), units_of("pt", false));
  EXPECT_SAYS_NOTHING_OF(complete, "is left out");
}

}  // namespace
}  // namespace helio
