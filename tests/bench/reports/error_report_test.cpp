// Statistics of the error curves, and the files that they are written to.
#include "tests/bench/reports/error_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/bench/reports/error_plot.h"
#include "tests/support/random.h"

namespace helio::bench {
namespace {

TEST(MeanInterval, MatchesHandCalculation) {
  // Mean 2, sum of squares about it 2, standard error sqrt(2 / 2 / 3) = 0.57735; 4.302653 of it for 2 degrees.
  const Interval interval = mean_interval(std::vector<double>{1, 2, 3});
  EXPECT_DOUBLE_EQ(interval.mean, 2);
  EXPECT_NEAR(interval.low, 2 - 4.302653 * 0.5773503, 1e-5);
  EXPECT_NEAR(interval.high, 2 + 4.302653 * 0.5773503, 1e-5);
}

TEST(MeanInterval, OfOneSeedIsUnbounded) {
  const Interval interval = mean_interval(std::vector<double>{7});
  EXPECT_EQ(interval.mean, 7);
  EXPECT_EQ(interval.low, -std::numeric_limits<double>::infinity());
  EXPECT_EQ(interval.high, std::numeric_limits<double>::infinity());
}

// Of 1,000 intervals over five normal numbers each, 95 % hold the truth; 3.5 standard errors of that share are 0.0241.
TEST(MeanInterval, CoversTheTruthAsOftenAsItSays) {
  test::Random random(11);
  const auto normal = [&] {
    return std::sqrt(-2 * std::log(1 - random.next_double())) * std::cos(2 * M_PI * random.next_double());
  };
  constexpr int kTries = 1000;
  int covered = 0;
  for (int i = 0; i < kTries; ++i) {
    std::vector<double> values(5);
    for (double& v : values) v = 3 + 2 * normal();
    const Interval interval = mean_interval(values);
    covered += interval.low <= 3 && interval.high >= 3;
  }
  EXPECT_NEAR(double(covered) / kTries, 0.95, 0.0241);
}

std::vector<CurveReport> two_curves() {
  const std::vector<PictureError> coarse = {{0.1, 4, 2, 0.5, 0.25}, {0.3, 8, 6, 0.7, -0.25}};
  const std::vector<PictureError> fine = {{1, 1, 0.5, 0.1, 0.125}, {1, 1, 0.5, 0.1, 0.125}};
  CurveReport ours{"box <A&B>", "heliograph", "pt", 0.01, {summarise(1, coarse), summarise(2, fine)}};
  CurveReport theirs{"box <A&B>", "other, \"1.0\"", "path", 0, {summarise(1, {coarse.data(), 1})}};
  return {ours, theirs};
}

TEST(ErrorReport, SummarisesOverSeeds) {
  const CurvePointReport point = two_curves()[0].points[0];
  EXPECT_EQ(point.samples, 1);
  EXPECT_EQ(point.seeds, 2);
  EXPECT_DOUBLE_EQ(point.mse.mean, 6);
  EXPECT_DOUBLE_EQ(point.relmse.mean, 4);
  EXPECT_DOUBLE_EQ(point.dssim.mean, 0.6);
  EXPECT_DOUBLE_EQ(point.seconds.mean, 0.2);
  // 0.25 and -0.25: mean 0, standard error 0.25 sqrt(2) / sqrt(2).
  EXPECT_DOUBLE_EQ(point.bias, 0);
  EXPECT_NEAR(point.bias_standard_error, 0.25, 1e-9);
}

TEST(ErrorReport, JsonHoldsEveryPointAndNullForWhatIsNotKnown) {
  const auto json = nlohmann::json::parse(to_json(two_curves()));
  ASSERT_EQ(json.at("curves").size(), 2u);
  const auto& ours = json["curves"][0];
  EXPECT_EQ(ours["scene"], "box <A&B>");
  EXPECT_EQ(ours["mode"], "pt");
  EXPECT_EQ(ours["reference_mse"], 0.01);
  ASSERT_EQ(ours["points"].size(), 2u);
  EXPECT_EQ(ours["points"][1]["samples"], 2);
  EXPECT_EQ(ours["points"][1]["mse"]["mean"], 1.0);
  EXPECT_EQ(ours["points"][1]["bias"], 0.125);
  EXPECT_EQ(ours["points"][1]["samples_per_second"], 2.0);
  const auto& single = json["curves"][1]["points"][0];
  EXPECT_EQ(single["relmse"]["mean"], 2.0);
  EXPECT_TRUE(single["relmse"]["low"].is_null());
  EXPECT_TRUE(single["bias_standard_error"].is_null());
}

// Fields of one line of RFC 4180.
std::vector<std::string> csv_fields(const std::string& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += line[i++];
    } else if (line[i] == '"') {
      quoted = !quoted;
    } else if (line[i] == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += line[i];
    }
  }
  return fields;
}

TEST(ErrorReport, CsvHasAFieldForEveryColumn) {
  std::istringstream lines(to_csv(two_curves()));
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> columns = csv_fields(line);
  ASSERT_EQ(columns.size(), 29u);
  const auto column = [&](const char* name) {
    return std::size_t(std::find(columns.begin(), columns.end(), name) - columns.begin());
  };
  std::vector<std::vector<std::string>> rows;
  while (std::getline(lines, line)) rows.push_back(csv_fields(line));
  ASSERT_EQ(rows.size(), 3u);
  for (const auto& row : rows) EXPECT_EQ(row.size(), columns.size());
  EXPECT_EQ(rows[0][column("relmse")], "4");
  EXPECT_EQ(rows[1][column("samples")], "2");
  EXPECT_EQ(rows[1][column("bias")], "0.125");
  EXPECT_EQ(rows[2][column("renderer")], "other, \"1.0\"");
  EXPECT_EQ(rows[2][column("relmse_high")], "");
}

int count_of(const std::string& text, const std::string& what) {
  int count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(ErrorPlot, DrawsEveryCurveInBothPanelsAndEscapesText) {
  const std::string svg = to_svg(two_curves());
  EXPECT_EQ(svg.rfind("<svg ", 0), 0u);
  EXPECT_EQ(svg.substr(svg.size() - 7), "</svg>\n");
  EXPECT_EQ(count_of(svg, "class=\"curve\""), 4);
  EXPECT_EQ(count_of(svg, "<circle"), 6);         // three points, twice
  EXPECT_EQ(count_of(svg, "class=\"band\""), 2);  // one seed alone has no interval
  EXPECT_EQ(count_of(svg, "box &lt;A&amp;B&gt;"), 1);
  EXPECT_EQ(count_of(svg, "<A"), 0);
  EXPECT_EQ(count_of(svg, "nan") + count_of(svg, "inf"), 0);
}

TEST(ErrorPlot, LeavesOutWhatLogarithmsCannotShow) {
  std::vector<CurveReport> curves = two_curves();
  curves[0].points[0].relmse.mean = 0;
  curves[0].points[1].seconds.mean = std::numeric_limits<double>::quiet_NaN();
  const std::string svg = to_svg(curves);
  // Ours: by time none is left, by samples the second; theirs: one point in both.
  EXPECT_EQ(count_of(svg, "<circle"), 3);
  EXPECT_EQ(count_of(svg, "nan"), 0);
  EXPECT_EQ(count_of(to_svg({}), "<circle"), 0);
}

// Points of a line that falls by the square root move by the same distance each time the samples double.
TEST(ErrorPlot, AxesAreLogarithmic) {
  CurveReport curve{"s", "r", "m", 0, {}};
  for (const int samples : {1, 10, 100}) {
    const std::vector<PictureError> same(2, PictureError{samples * 0.1, 0, 1.0 / samples, 0, 0});
    curve.points.push_back(summarise(samples, same));
  }
  const std::string svg = to_svg(std::vector<CurveReport>{curve});
  const std::size_t at = svg.find("class=\"curve\" d=\"M") + 18;
  double x[3], y[3];
  ASSERT_EQ(std::sscanf(svg.c_str() + at, "%lf %lfL%lf %lfL%lf %lf", &x[0], &y[0], &x[1], &y[1], &x[2], &y[2]), 6);
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.11);
  EXPECT_NEAR(y[1] - y[0], y[2] - y[1], 0.11);
  EXPECT_GT(x[1], x[0]);
  EXPECT_GT(y[1], y[0]);  // downwards
}

}  // namespace
}  // namespace helio::bench
