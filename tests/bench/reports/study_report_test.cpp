// The study's report: ratios at equal time and the dark half by hand calculation, JSON and markdown with every setting.
#include "tests/bench/reports/study_report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>


namespace helio::bench {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

CurvePointReport point(int samples, double seconds, double mse) {
  PictureError error;
  error.seconds = seconds;
  error.mse = mse;
  error.relmse = 2 * mse;
  error.distance_variance = 0.5 * mse;
  error.dark_relmse = kNan;
  error.bias = 0.01;
  return summarise(samples, std::vector<PictureError>(2, error));
}

// Plain: error 1 / seconds. Ours: half of that at 2 s, a quarter at 16 s, beyond plain's last point.
StudyReport small_report() {
  StudyReport report;
  report.settings = {{"plain", {}, {}, {}}, {"paper 4/32", 4, 32, 0.125}};
  const CurveReport plain{
      "box", "heliograph", "plain", 0.001, {point(4, 1, 1), point(8, 4, 0.25), point(16, 8, 0.125)}};
  const CurveReport ours{
      "box", "heliograph", "paper 4/32", 0.001, {point(4, 2, 0.25), point(8, 8, 0.125), point(16, 16, 1 / 64.0)}};
  report.results = {{{"box", "a box", "said | nothing"}, {plain, ours}}};
  return report;
}

TEST(ValueAt, FollowsAPowerOfTimeBetweenAndBeyondPoints) {
  const CurveReport plain = small_report().results[0].curves[0];
  for (const double seconds : {0.5, 1.0, 2.0, 5.0, 8.0, 100.0}) {
    EXPECT_NEAR(value_at(plain, &CurvePointReport::mse, seconds), 1 / seconds, 1e-12) << seconds;
  }
}

TEST(ValueAt, IsNotANumberWhereThereIsNoPower) {
  CurveReport curve{"s", "r", "m", 0, {point(4, 1, 1)}};
  EXPECT_TRUE(std::isnan(value_at(curve, &CurvePointReport::mse, 2)));
  curve.points.push_back(point(8, 1, 0.5));  // no later than the first
  EXPECT_TRUE(std::isnan(value_at(curve, &CurvePointReport::mse, 2)));
  curve.points[1] = point(8, 2, 0);
  EXPECT_TRUE(std::isnan(value_at(curve, &CurvePointReport::mse, 2)));
  curve.points[1] = point(8, 2, 0.5);
  EXPECT_TRUE(std::isnan(value_at(curve, &CurvePointReport::mse, 0)));
  EXPECT_TRUE(std::isnan(value_at(curve, &CurvePointReport::dark_relmse, 2)));
}

TEST(OverPlain, ComparesAtEqualTime) {
  const StudyResult result = small_report().results[0];
  EXPECT_NEAR(over_plain(result, 1, 0, &CurvePointReport::mse), 0.5, 1e-12);
  EXPECT_NEAR(over_plain(result, 1, 1, &CurvePointReport::relmse), 1, 1e-12);
  EXPECT_NEAR(over_plain(result, 1, 2, &CurvePointReport::distance_variance), 0.25, 1e-12);
  EXPECT_EQ(over_plain(result, 0, 0, &CurvePointReport::mse), 1);
  EXPECT_TRUE(std::isnan(over_plain(result, 1, 0, &CurvePointReport::dark_relmse)));
}

TEST(StudyReport, JsonHoldsSettingsRatiosAndNullForWhatIsNotKnown) {
  const auto json = nlohmann::json::parse(to_json(small_report()));
  EXPECT_TRUE(json.at("settings")[0].at("min_samples").is_null());
  EXPECT_EQ(json["settings"][1]["max_samples"], 32);
  EXPECT_EQ(json["settings"][1]["paper_probability"], 0.125);
  const auto& scene = json.at("scenes").at(0);
  EXPECT_EQ(scene.at("property"), "a box");
  ASSERT_EQ(scene.at("curves").size(), 2u);
  const auto& curve = scene["curves"][1];
  EXPECT_EQ(curve.at("mode"), "paper 4/32");
  EXPECT_EQ(curve.at("points")[2].at("distance_variance").at("mean"), 1 / 128.0);
  EXPECT_NEAR(curve.at("over_plain")[2].at("mse").get<double>(), 0.25, 1e-12);
  EXPECT_TRUE(curve["over_plain"][2].at("dark_relmse").is_null());
}

TEST(StudyReport, MarkdownHasARowPerSettingAndEqualNumbersOfCells) {
  std::string text = to_markdown(small_report());
  // By hand: at the last point the variance of distance and mse are 0.25 of plain's, the dark half is not known.
  EXPECT_NE(text.find("| paper 4/32 | 4 | 32 | 0.125 | 0.25 (0.25) | 0.25 (0.25) | 0.25 (0.25) | - |"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("| paper 4/32 | 0.50 | 1.00 | 0.25 | 0.25 | 0.25 | - | +1.00 | +0.00 |"), std::string::npos)
      << text;
  EXPECT_NE(text.find("| plain | 1.00 | 1.00 | 1.00 | 1.00 | 1.00 | - | +1.00 | +0.00 |"), std::string::npos) << text;
  EXPECT_EQ(text.find("nan"), std::string::npos);
}

}  // namespace
}  // namespace helio::bench
