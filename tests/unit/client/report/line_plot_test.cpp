#include "client/report/line_plot.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>
#include <set>

namespace helio::report {
namespace {

int count_of(const std::string& text, const std::string& what) {
  int count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

LinePlot two_series() {
  LinePlot plot{"seconds", "error <x>", PlotScale::logarithmic, PlotScale::logarithmic, {}};
  plot.series.push_back({0,
                         {{1, 1, PlotPoint::Band{0.5, 2}},
                          {10, 0.1, PlotPoint::Band{0.05, 0.2}},
                          {100, 0.01, PlotPoint::Band{0.005, 0.02}}}});
  plot.series.push_back({1, {{1, 2, {}}, {10, 0.2, {}}}});
  return plot;
}

TEST(LinePlot, DrawsCurvesAndTheBandsThatAreKnown) {
  const std::string svg = draw_panel(two_series());
  EXPECT_EQ(count_of(svg, "class=\"curve\""), 2);
  EXPECT_EQ(count_of(svg, "class=\"band\""), 1);
  EXPECT_EQ(count_of(svg, "error &lt;x&gt;"), 1);
}

// The error falls by ten each time the seconds grow by ten: steps of equal length, downwards on the page.
TEST(LinePlot, AxesAreLogarithmic) {
  const std::string svg = draw_panel(two_series());
  const char* const begin = "class=\"curve\" d=\"";
  const std::size_t at = svg.find(begin) + std::string(begin).size();
  double x[3], y[3];
  ASSERT_EQ(std::sscanf(svg.c_str() + at, "M%lf %lfl%lf %lf %lf %lf", &x[0], &y[0], &x[1], &y[1], &x[2], &y[2]), 6);
  EXPECT_NEAR(x[1], x[2], 0.51);  // rounded to halves
  EXPECT_NEAR(y[1], y[2], 0.51);
  EXPECT_GT(x[1], 50);
  EXPECT_GT(y[1], 50);
}

TEST(LinePlot, LeavesOutWhatLogarithmsCannotShow) {
  LinePlot plot = two_series();
  plot.series[0].points[1].y = -0.1;
  plot.series[1].points[0].x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(points_left_out(plot), 2);
  const std::string svg = draw_panel(plot);
  EXPECT_EQ(count_of(svg, "nan") + count_of(svg, "inf"), 0);
  plot.y_scale = PlotScale::linear;
  EXPECT_EQ(points_left_out(plot), 1);
  EXPECT_EQ(draw_panel(LinePlot{}), "");
}

TEST(LinePlot, StylesDiffer) {
  const std::string style = plot_style(280, false), markers = plot_markers(280);
  std::set<std::string> looks;
  for (int i = 0; i < 280; ++i) {
    const auto after = [](const std::string& text, const std::string& begin, const char* end) {
      const std::size_t at = text.find(begin);
      EXPECT_NE(at, std::string::npos) << begin;
      return text.substr(at + begin.size(), text.find(end, at) - at - begin.size());
    };
    const std::string name = std::to_string(i);
    looks.insert(after(style, ".s" + name + " .curve{stroke:", "}") +
                 after(style, ".s" + name + " .curve{stroke-dasharray:", ";") +
                 after(markers, "id=\"k" + name + "\"", "/></marker>").substr(120));
  }
  EXPECT_EQ(looks.size(), 280u);
  EXPECT_EQ(count_of(plot_markers(3), "<marker "), 3);
  EXPECT_NE(plot_style(3, true).find("prefers-color-scheme:dark"), std::string::npos);
  EXPECT_EQ(plot_style(3, false).find("prefers-color-scheme:dark"), std::string::npos);
}

}  // namespace
}  // namespace helio::report
