#include "client/report/line_plot.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>

#include "client/report/html_text.h"

namespace helio::report {
namespace {

// Pixels between the border of a panel and its axes.
constexpr double kLeft = 74, kRight = 14, kTop = 26, kBottom = 52;
constexpr double kWidth = kPanelWidth - kLeft - kRight, kHeight = kPanelHeight - kTop - kBottom;
constexpr int kColors = 8, kDashes = 5, kMarkers = 7;
constexpr double kFewDecades = 3;    // an axis of fewer also has ticks at 2 and 5
constexpr double kManyDecades = 12;  // one of more has not all
constexpr double kDigitWidth = 7.5;  // of text of 13 pixels, about
constexpr double kMargin = 0.03;     // of an axis, beyond the outermost points

// Distinct for the colour-blind, after Okabe and Ito 2008, darkened for white paper and lightened for black screens.
constexpr const char* kLightColors[kColors] = {"#0060a8", "#c44e00", "#00795a", "#b0458b",
                                               "#a06c00", "#2a86bd", "#222222", "#6f52b5"};
constexpr const char* kDarkColors[kColors] = {"#5fb4ff", "#ff8f4a", "#2fd0a0", "#f08cc6",
                                              "#f2bd3f", "#9adcff", "#eeeeee", "#b9a2ff"};
constexpr const char* kDashArrays[kDashes] = {"none", "8 4", "2 3", "10 3 2 3", "5 2"};
// Around (6, 6) in a box of 12.
constexpr const char* kMarkerPaths[kMarkers] = {
    "M2 6a4 4 0 1 0 8 0a4 4 0 1 0-8 0z",                                              // disc
    "M2.5 2.5h7v7h-7z",                                                               // square
    "M6 1.5l4.5 8h-9z",                                                               // triangle
    "M6 1l5 5l-5 5l-5-5z",                                                            // diamond
    "M6 10.5l4.5-8h-9z",                                                              // triangle, downwards
    "M4.7 1h2.6v3.7h3.7v2.6h-3.7v3.7h-2.6v-3.7h-3.7v-2.6h3.7z",                       // plus
    "M2.2 1L6 4.8L9.8 1L11 2.2L7.2 6L11 9.8L9.8 11L6 7.2L2.2 11L1 9.8L4.8 6L1 2.2z",  // cross
};

bool drawable(double value, PlotScale scale) {
  return std::isfinite(value) && (scale == PlotScale::linear || value > 0);
}

// "12.3", "12".
std::string pixels(double value) {
  const long tenths = std::lround(10 * value);
  return tenths % 10 == 0 ? fmt::format("{}", tenths / 10) : fmt::format("{:.1f}", double(tenths) / 10);
}

std::string tick_text(double value) {
  if (value != 0 && (std::abs(value) < 0.9e-3 || std::abs(value) >= 0.9e5)) {
    const int exponent = int(std::floor(std::log10(std::abs(value)) + 1e-9));
    return fmt::format("{:.3g}e{}", value / std::pow(10, exponent), exponent);
  }
  return fmt::format("{:.6g}", value);
}

class Axis {
 public:
  explicit Axis(PlotScale scale) : scale_(scale) {}

  void include(double value) {
    if (!drawable(value, scale_)) return;
    first_ = std::min(first_, mapped(value));
    last_ = std::max(last_, mapped(value));
  }
  bool empty() const { return first_ > last_; }
  // Room beyond the outermost points, and some length where all are equal.
  void widen() {
    const double least = scale_ == PlotScale::logarithmic ? 0.3 : std::max(1e-12, 0.1 * std::abs(last_));
    if (last_ - first_ < least) {
      const double middle = (first_ + last_) / 2;
      first_ = middle - least / 2;
      last_ = middle + least / 2;
    }
    const double margin = kMargin * (last_ - first_);
    first_ -= margin;
    last_ += margin;
  }
  // 0 at the lower end, 1 at the upper; clamped.
  double share(double value) const {
    if (!drawable(value, scale_)) return 0;
    return std::clamp((mapped(value) - first_) / (last_ - first_), 0.0, 1.0);
  }
  bool holds(double value) const {
    return drawable(value, scale_) && mapped(value) >= first_ && mapped(value) <= last_;
  }
  std::vector<double> ticks() const {
    std::vector<double> all;
    const auto add = [&](double value) {
      const double at = mapped(value);
      if (at >= first_ && at <= last_) all.push_back(value);
    };
    if (scale_ == PlotScale::linear) {
      const double raw = (last_ - first_) / 5, power = std::pow(10, std::floor(std::log10(raw)));
      const double step = raw / power < 1.5   ? power
                          : raw / power < 3.5 ? 2 * power
                          : raw / power < 7.5 ? 5 * power
                                              : 10 * power;
      for (double n = std::ceil(first_ / step); n * step <= last_; ++n) all.push_back(n * step);
      return all;
    }
    const double span = last_ - first_;
    const int stride = std::max(1, int(std::ceil(span / kManyDecades)));
    for (double decade = std::floor(first_); decade <= std::ceil(last_); decade += stride) {
      for (const double part : {1.0, 2.0, 5.0}) {
        if (part == 1 || span < kFewDecades) add(part * std::pow(10, decade));
      }
    }
    return all;
  }

 private:
  double mapped(double value) const { return scale_ == PlotScale::logarithmic ? std::log10(value) : value; }

  PlotScale scale_;
  double first_ = std::numeric_limits<double>::infinity(), last_ = -first_;
};

struct Panel {
  double left, top;  // of the axes
  Axis x, y;

  double at_x(double value) const { return left + x.share(value) * kWidth; }
  double at_y(double value) const { return top + (1 - y.share(value)) * kHeight; }
};

std::string text_at(double x, double y, const std::string& text) {
  return fmt::format("<text x=\"{}\" y=\"{}\">{}</text>", pixels(x), pixels(y), escaped(text));
}

std::string draw_axes(const Panel& panel, const LinePlot& plot) {
  const double bottom = panel.top + kHeight;
  std::string grid, below, beside;
  const auto add_tick = [&](double tick, bool labelled) {
    const double x = panel.at_x(tick);
    grid += fmt::format("M{} {}V{}", pixels(x), pixels(panel.top), pixels(bottom));
    if (labelled) below += text_at(x, bottom + 17, tick_text(tick));
  };
  std::vector<double> given;
  std::copy_if(plot.x_ticks.begin(), plot.x_ticks.end(), std::back_inserter(given),
               [&](double tick) { return panel.x.holds(tick); });
  if (given.empty()) {
    for (const double tick : panel.x.ticks()) add_tick(tick, true);
  }
  double end = -std::numeric_limits<double>::infinity();  // of the label before
  for (const double tick : given) {
    const double half = kDigitWidth / 2 * double(tick_text(tick).size());
    const bool fits = panel.at_x(tick) - half > end + kDigitWidth;
    if (fits) end = panel.at_x(tick) + half;
    add_tick(tick, fits);
  }
  for (const double tick : panel.y.ticks()) {
    const double y = panel.at_y(tick);
    grid += fmt::format("M{} {}H{}", pixels(panel.left), pixels(y), pixels(panel.left + kWidth));
    beside += text_at(panel.left - 7, y + 4, tick_text(tick));
  }
  below += text_at(panel.left + kWidth / 2, bottom + 38, plot.x_label);
  const std::string above = text_at(panel.left - 6, panel.top - 10, plot.y_label);
  return fmt::format(
      "<path class=\"grid\" d=\"{}\"/><rect class=\"frame\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>{}"
      "<g text-anchor=\"middle\">{}</g><g text-anchor=\"end\">{}</g>\n",
      grid, pixels(panel.left), pixels(panel.top), pixels(kWidth), pixels(kHeight), above, below, beside);
}

// A path of straight lines: the first point as it is, the others as steps, of whole parts of a pixel so that they do
// not drift.
class PathText {
 public:
  explicit PathText(int parts) : parts_(parts) {}

  void add(double x, double y) {
    const long to[2] = {std::lround(parts_ * x), std::lround(parts_ * y)};
    const std::string step = text_of(to[0] - at_[0]);
    if (text_.empty())
      text_ = "M" + step;
    else
      text_ += (steps_++ == 0 ? "l" : separator(step)) + step;
    const std::string down = text_of(to[1] - at_[1]);
    text_ += separator(down) + down;
    at_[0] = to[0];
    at_[1] = to[1];
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_of(long parts) const { return pixels(double(parts) / parts_); }
  static std::string separator(const std::string& number) { return number[0] == '-' ? "" : " "; }

  int parts_, steps_ = 0;
  std::string text_;
  long at_[2] = {0, 0};
};

std::string draw_series(const Panel& panel, const LinePlot& plot, const PlotSeries& series) {
  struct Edge {
    double x, low, high;
  };
  std::vector<Edge> band;
  std::string bands;
  const auto end_band = [&] {
    PathText path(1);
    for (auto edge = band.begin(); edge != band.end(); ++edge) path.add(edge->x, edge->high);
    for (auto edge = band.rbegin(); edge != band.rend(); ++edge) path.add(edge->x, edge->low);
    if (!band.empty()) bands += path.text() + "z";
    band.clear();
  };
  PathText line(2);
  for (const PlotPoint& point : series.points) {
    if (!drawable(point.x, plot.x_scale) || !drawable(point.y, plot.y_scale)) continue;
    const double x = panel.at_x(point.x);
    line.add(x, panel.at_y(point.y));
    if (!point.interval || !std::isfinite(point.interval->low) || !std::isfinite(point.interval->high)) {
      end_band();  // a band ends where the interval of a point is not known
      continue;
    }
    band.push_back({x, panel.at_y(point.interval->low), panel.at_y(point.interval->high)});
  }
  end_band();
  if (line.text().empty()) return {};
  std::string svg = fmt::format("<g class=\"{}\">", series_class(series.style));
  if (!bands.empty()) svg += fmt::format("<path class=\"band\" d=\"{}\"/>", bands);
  // A step of length 0, for a path of one point has no end to put a marker at.
  return svg + fmt::format("<path class=\"curve\" d=\"{}h0\"/></g>\n", line.text());
}

template <class Visit>
void for_each_point(const LinePlot& plot, const Visit& visit) {
  for (const PlotSeries& series : plot.series) {
    for (const PlotPoint& point : series.points) visit(point);
  }
}

}  // namespace

std::string draw_panel(const LinePlot& plot, double left, double top) {
  Panel panel{left + kLeft, top + kTop, Axis(plot.x_scale), Axis(plot.y_scale)};
  for_each_point(plot, [&](const PlotPoint& point) {
    if (!drawable(point.x, plot.x_scale) || !drawable(point.y, plot.y_scale)) return;
    panel.x.include(point.x);
    panel.y.include(point.y);
    if (!point.interval) return;
    // The lower end of a wide interval would squeeze the curves into the upper part of a logarithmic axis.
    const bool far = plot.y_scale == PlotScale::logarithmic && point.interval->low < 0.1 * point.y;
    panel.y.include(far ? 0.1 * point.y : point.interval->low);
    panel.y.include(point.interval->high);
  });
  if (panel.x.empty() || panel.y.empty()) return {};
  panel.x.widen();
  panel.y.widen();
  std::string svg = draw_axes(panel, plot);
  for (const PlotSeries& series : plot.series) svg += draw_series(panel, plot, series);
  return svg;
}

int points_left_out(const LinePlot& plot) {
  int count = 0;
  for_each_point(plot, [&](const PlotPoint& point) {
    if (!drawable(point.x, plot.x_scale) || !drawable(point.y, plot.y_scale)) ++count;
  });
  return count;
}

std::string series_class(std::size_t style) {
  return fmt::format("series s{}", style);
}

std::string legend_sample(std::size_t style) {
  return fmt::format(
      "<svg class=\"sample\" width=\"44\" height=\"14\" viewBox=\"0 0 44 14\" aria-hidden=\"true\"><g "
      "class=\"{}\"><path class=\"curve\" d=\"M6 7h16h16\"/></g></svg>",
      series_class(style));
}

std::string plot_markers(std::size_t count) {
  std::string defs;
  for (std::size_t i = 0; i < count; ++i) {
    defs += fmt::format(
        "<marker id=\"k{0}\" class=\"s{0}\" markerUnits=\"userSpaceOnUse\" markerWidth=\"10\" "
        "markerHeight=\"10\" viewBox=\"0 0 12 12\" refX=\"6\" refY=\"6\"><path class=\"dot\" "
        "d=\"{1}\"/></marker>",
        i, kMarkerPaths[i % kMarkers]);
  }
  return "<defs>" + defs + "</defs>\n";
}

std::string plot_style(std::size_t count, bool dark_too) {
  const auto colors = [count](std::span<const char* const> list, const char* frame, const char* grid) {
    std::string css;
    for (std::size_t i = 0; i < count; ++i) {
      css +=
          fmt::format(".s{0} .curve{{stroke:{1}}}.s{0} .band{{fill:{1};stroke:{1}}}.s{0} .dot,.s{0} .bin{{fill:{1}}}\n",
                      i, list[i % list.size()]);
    }
    return css + fmt::format(".grid{{stroke:{}}}.frame{{stroke:{}}}\n", grid, frame);
  };
  std::string css =
      ".curve{fill:none;stroke-width:2}.band{fill-opacity:.17;stroke-opacity:.4;stroke-width:.7}"
      ".grid,.frame{fill:none}\n";
  for (std::size_t i = 0; i < count; ++i) {
    css += fmt::format(".s{0} .curve{{stroke-dasharray:{1};marker:url(#k{0})}}\n", i, kDashArrays[i % kDashes]);
  }
  css += colors(kLightColors, "#777", "#ddd");
  if (dark_too) css += "@media screen and (prefers-color-scheme:dark){\n" + colors(kDarkColors, "#888", "#333") + "}\n";
  return css;
}

}  // namespace helio::report
