#include "tests/bench/reports/error_plot.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace helio::bench {

namespace {

// Pixels.
constexpr double kPanelWidth = 460, kPanelHeight = 300, kLeft = 70, kTop = 40, kBottom = 50, kRight = 20;
constexpr double kLegendLine = 18;
// Distinct for the colour-blind (Okabe and Ito 2008).
constexpr const char* kColors[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"};
// Later curves let those that they lie on show through: modes are often equal in part. stroke-dasharray; 0: solid.
constexpr const char* kDashes[] = {"0", "7 5", "2 4"};

struct Style {
  const char* color;
  const char* dashes;
  double marker;  // radius
};

Style style_of(std::size_t curve) {
  return {kColors[curve % std::size(kColors)], kDashes[curve % std::size(kDashes)], curve == 0 ? 4.0 : 2.5};
}

bool drawable(double value) {
  return std::isfinite(value) && value > 0;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char letter : text) {
    if (letter == '&')
      out += "&amp;";
    else if (letter == '<')
      out += "&lt;";
    else if (letter == '>')
      out += "&gt;";
    else if (letter == '"')
      out += "&quot;";
    else
      out += letter;
  }
  return out;
}

// A logarithmic axis over whole decades.
struct Axis {
  double first = std::numeric_limits<double>::infinity(), last = -first;  // log10

  void include(double value) {
    if (!drawable(value)) return;
    first = std::min(first, std::floor(std::log10(value)));
    last = std::max(last, std::ceil(std::log10(value)));
  }
  bool empty() const { return first > last; }
  void widen() {
    if (first == last) ++last;
  }
  double share(double value) const { return std::clamp((std::log10(value) - first) / (last - first), 0.0, 1.0); }
};

// One of the two panels of a scene.
struct Panel {
  double left, top;
  Axis x, y;

  double at_x(double value) const { return left + x.share(value) * kPanelWidth; }
  double at_y(double value) const { return top + (1 - y.share(value)) * kPanelHeight; }
};

using Abscissa = double (*)(const CurvePointReport&);
double seconds_of(const CurvePointReport& p) {
  return p.seconds.mean;
}
double samples_of(const CurvePointReport& p) {
  return p.samples;
}

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor, escaped(text));
}

std::string draw_axes(const Panel& panel, const char* x_label) {
  const double bottom = panel.top + kPanelHeight;
  std::string svg = fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.0f}\" height=\"{:.0f}\" fill=\"none\" stroke=\"#888\"/>\n",
      panel.left, panel.top, kPanelWidth, kPanelHeight);
  for (double decade = panel.x.first; decade <= panel.x.last; ++decade) {
    const double x = panel.at_x(std::pow(10, decade));
    svg += fmt::format("<path d=\"M{0:.1f} {1:.1f}V{2:.1f}\" stroke=\"#ddd\"/>\n", x, panel.top, bottom);
    svg += text_at(x, bottom + 16, "middle", fmt::format("1e{:.0f}", decade));
  }
  for (double decade = panel.y.first; decade <= panel.y.last; ++decade) {
    const double y = panel.at_y(std::pow(10, decade));
    svg += fmt::format("<path d=\"M{0:.1f} {1:.1f}H{2:.1f}\" stroke=\"#ddd\"/>\n", panel.left, y,
                       panel.left + kPanelWidth);
    svg += text_at(panel.left - 6, y + 4, "end", fmt::format("1e{:.0f}", decade));
  }
  return svg + text_at(panel.left + kPanelWidth / 2, bottom + 36, "middle", x_label);
}

std::string draw_curve(const Panel& panel, const CurveReport& curve, Abscissa abscissa, const Style& style) {
  std::string upper, lower, line, markers;
  for (const CurvePointReport& p : curve.points) {
    const double x_value = abscissa(p);
    if (!drawable(x_value) || !drawable(p.relmse.mean)) continue;
    const double x = panel.at_x(x_value), y = panel.at_y(p.relmse.mean);
    line += fmt::format("{}{:.1f} {:.1f}", line.empty() ? "M" : "L", x, y);
    markers += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\"/>\n", x, y, style.marker,
                           style.color);
    if (!std::isfinite(p.relmse.high) || !std::isfinite(p.relmse.low)) continue;
    const double low = p.relmse.low > 0 ? panel.at_y(p.relmse.low) : panel.top + kPanelHeight;
    upper += fmt::format("{}{:.1f} {:.1f}", upper.empty() ? "M" : "L", x, panel.at_y(p.relmse.high));
    lower = fmt::format("L{:.1f} {:.1f}", x, low) + lower;
  }
  std::string svg;
  if (!upper.empty())
    svg +=
        fmt::format("<path class=\"band\" d=\"{}{}Z\" fill=\"{}\" fill-opacity=\"0.2\"/>\n", upper, lower, style.color);
  if (!line.empty())
    svg += fmt::format(
        "<path class=\"curve\" d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\" stroke-dasharray=\"{}\"/>\n",
        line, style.color, style.dashes);
  return svg + markers;
}

Panel make_panel(double left, double top, std::span<const CurveReport* const> curves, Abscissa abscissa) {
  Panel panel{left, top, {}, {}};
  for (const CurveReport* curve : curves) {
    for (const CurvePointReport& p : curve->points) {
      if (!drawable(abscissa(p)) || !drawable(p.relmse.mean)) continue;
      panel.x.include(abscissa(p));
      for (const double value : {p.relmse.mean, p.relmse.low, p.relmse.high}) panel.y.include(value);
    }
  }
  panel.x.widen();
  panel.y.widen();
  return panel;
}

}  // namespace

std::string to_svg(std::span<const CurveReport> curves) {
  std::vector<std::string> scenes;
  for (const CurveReport& curve : curves) {
    if (std::find(scenes.begin(), scenes.end(), curve.scene) == scenes.end()) scenes.push_back(curve.scene);
  }
  const double full_panel = kLeft + kPanelWidth + kRight;
  std::string body;
  double top = 0;
  for (const std::string& scene : scenes) {
    std::vector<const CurveReport*> shown;
    for (const CurveReport& curve : curves) {
      if (curve.scene == scene) shown.push_back(&curve);
    }
    body += text_at(kLeft, top + kTop - 14, "start", scene + ": relMSE, mean and 95 % interval over seeds");
    int column = 0;
    for (const auto& [abscissa, label] :
         {std::pair<Abscissa, const char*>{seconds_of, "seconds"}, {samples_of, "samples per pixel"}}) {
      const Panel panel = make_panel(kLeft + column++ * full_panel, top + kTop, shown, abscissa);
      if (panel.x.empty()) continue;
      body += draw_axes(panel, label);
      for (std::size_t i = 0; i < shown.size(); ++i) body += draw_curve(panel, *shown[i], abscissa, style_of(i));
    }
    top += kTop + kPanelHeight + kBottom;
    for (std::size_t i = 0; i < shown.size(); ++i, top += kLegendLine) {
      const Style style = style_of(i);
      body += fmt::format("<path d=\"M{:.1f} {:.1f}h30\" stroke=\"{}\" stroke-width=\"2\" stroke-dasharray=\"{}\"/>\n",
                          kLeft, top, style.color, style.dashes);
      body += text_at(kLeft + 38, top + 4, "start", shown[i]->renderer + " " + shown[i]->mode);
    }
    top += kLegendLine;
  }
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
             "{1:.0f}\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" "
             "fill=\"white\"/>\n",
             2 * full_panel, std::max(top, 1.0)) +
         body + "</svg>\n";
}

}  // namespace helio::bench
