#include "client/report/measure_section.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "client/report/html_text.h"
#include "client/report/line_plot.h"
#include "client/report/measure_names.h"
#include "client/report/number_text.h"
#include "client/report/ratio_table.h"

namespace helio::report {
namespace {

enum class Abscissa { seconds, samples };
constexpr int kMostTicks = 12;  // more budgets would crowd the axis

LinePlot plot_of(const ReportData& data, const MeasuredPart& part, Abscissa abscissa) {
  LinePlot plot;
  const MeasureName name = name_of(part.measure);
  plot.x_label = abscissa == Abscissa::seconds ? "seconds" : "samples per pixel";
  plot.y_label = name.title;
  plot.y_scale = name.scale;
  const auto& budgets = data.request().samples();
  if (abscissa == Abscissa::samples && budgets.size() <= kMostTicks)
    plot.x_ticks.assign(budgets.begin(), budgets.end());
  for (std::size_t mode = 0; mode < data.modes(); ++mode) {
    PlotSeries series{mode, {}};
    for (const pb::ComparePoint* point : data.points_of(mode)) {
      const pb::ComparePoint::Value* value = value_of(*point, part);
      if (!value) continue;
      const pb::CompareInterval& y = value->value();
      PlotPoint drawn{abscissa == Abscissa::seconds ? point->seconds().mean() : point->samples(), y.mean(), {}};
      if (y.known()) drawn.interval = {y.low(), y.high()};
      series.points.push_back(drawn);
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

std::string figure_of(const LinePlot& plot, const std::string& label) {
  const std::string panel = draw_panel(plot);
  const int left_out = points_left_out(plot);
  if (panel.empty()) return "<p class=\"note\">" + escaped(label) + ": no point can be drawn.</p>\n";
  std::string html = fmt::format(
      "<figure class=\"plot\"><svg role=\"img\" aria-label=\"{}\" viewBox=\"0 0 {:.0f} {:.0f}\">\n{}"
      "</svg>",
      escaped(label), kPanelWidth, kPanelHeight, panel);
  if (left_out > 0) {
    html += fmt::format("<figcaption>{} not positive and left out; see the values.</figcaption>",
                        left_out == 1 ? "One point is" : fmt::format("{} points are", left_out));
  }
  return html + "</figure>\n";
}

// Rows are budgets, columns are modes.
struct PointCell {
  const pb::CompareInterval* value;
  bool few_pixels_decide, disturbed;
};
using CellOf = std::function<std::optional<PointCell>(const pb::ComparePoint&)>;

std::string point_table(const ReportData& data, const std::string& caption, const CellOf& cell_of) {
  bool few = false, nothing = false, pixels = false, disturbed = false;
  std::string body;
  for (std::uint32_t budget = 0; budget < data.budgets(); ++budget) {
    body += "<tr><th>" + data.budget_text(budget);
    for (std::size_t mode = 0; mode < data.modes(); ++mode) {
      const pb::ComparePoint* point = data.point_of(mode, budget);
      const std::optional<PointCell> cell = point ? cell_of(*point) : std::nullopt;
      if (!cell) {
        body += "<td>–";
        continue;
      }
      body += "<td>" + number(cell->value->mean());
      if (cell->few_pixels_decide) body += "<sup>p</sup>";
      if (cell->disturbed) body += "<sup>d</sup>";
      pixels |= cell->few_pixels_decide;
      disturbed |= cell->disturbed;
      if (cell->value->known()) {
        body += "<br>" + interval_text(*cell->value);
      } else {
        body += data.has_few_seeds(mode) ? "<sup>a</sup>" : "<sup>b</sup>";
        (data.has_few_seeds(mode) ? few : nothing) = true;
      }
    }
    body += "\n";
  }
  std::string html = "<figure class=\"table\"><figcaption>" + caption +
                     "</figcaption><table class=\"points\"><thead><tr><th scope=\"col\">budget";
  for (std::size_t mode = 0; mode < data.modes(); ++mode) html += "<th>" + escaped(data.mode_name(mode));
  html += "<tbody>\n" + body + "</table>";
  const auto note = [&](bool wanted, const char* text) {
    if (wanted) html += std::string("<p class=\"note\">") + text + "</p>";
  };
  note(few, "a: no interval, because there are fewer than five seeds.");
  note(nothing, "b: no interval, because the seeds that are there do not allow one.");
  note(pixels,
       "p: a few pixels decide. The mean is that of rare, large errors; other seeds may come to quite another.");
  note(disturbed,
       "d: disturbed. Other programs used the processor while one or more units of the point were rendered.");
  return html + "</figure>\n";
}

std::string legend(const ReportData& data) {
  std::string html = "<ul class=\"legend\" aria-label=\"Modes\">";
  for (std::size_t mode = 0; mode < data.modes(); ++mode) {
    html += fmt::format("<li data-style=\"{}\">{}<span>{}</span>{}", mode, legend_sample(mode),
                        escaped(data.mode_name(mode)), mode == 0 ? " <small>baseline</small>" : "");
  }
  return html + "</ul>\n";
}

std::string part_section(const ReportData& data, const MeasuredPart& part) {
  const MeasureName name = name_of(part.measure);
  const std::string where = region_title(part.region), label = name.title + ", " + where;
  std::string html = fmt::format(
      "<section class=\"part\" data-measure=\"{}\" data-region=\"{}\"><h3>{}</h3><p>{}.{}</p>\n"
      "<div class=\"plots\">",
      name.key, escaped(part.region), escaped(label), escaped(name.definition),
      data.is_path() ? " Means over all views of the path." : "");
  html += figure_of(plot_of(data, part, Abscissa::seconds), label + " against seconds");
  html += figure_of(plot_of(data, part, Abscissa::samples), label + " against samples per pixel");
  html += "</div>\n<div class=\"tables\">";
  for (const auto kind :
       {pb::CompareRatio::KIND_EQUAL_ERROR, pb::CompareRatio::KIND_EQUAL_TIME, pb::CompareRatio::KIND_EQUAL_SAMPLES}) {
    html += ratio_table(data, kind, part);
  }
  html += point_table(data, "<strong>Every point</strong> Mean over seeds, with its 95 % interval.",
                      [&](const pb::ComparePoint& point) -> std::optional<PointCell> {
                        const pb::ComparePoint::Value* value = value_of(point, part);
                        if (!value) return std::nullopt;
                        return PointCell{&value->value(), value->few_pixels_decide(), false};
                      });
  return html + "</div></section>\n";
}

// Two lists, of the measures and regions that there are.
std::string selection(const ReportData& data) {
  std::string measures, regions;
  std::vector<std::string> seen_measures, seen_regions;
  const auto add = [](std::vector<std::string>& seen, std::string& options, const std::string& key,
                      const std::string& title) {
    if (std::find(seen.begin(), seen.end(), key) != seen.end()) return;
    seen.push_back(key);
    options += fmt::format("<option value=\"{}\">{}</option>", escaped(key), escaped(title));
  };
  for (const MeasuredPart& part : data.parts()) {
    const MeasureName name = name_of(part.measure);
    add(seen_measures, measures, name.key, name.title);
    add(seen_regions, regions, part.region, region_title(part.region));
  }
  return fmt::format(
      "<div class=\"controls scripted\" role=\"group\" aria-label=\"Measure shown\"><label>Measure <select "
      "id=\"measure\">{}</select></label><label>Region <select id=\"region\">{}</select></label></div>\n",
      measures, regions);
}

}  // namespace

std::string measure_section(const ReportData& data) {
  std::string html = "<section id=\"curves\"><h2>Error against time and samples</h2>\n";
  if (data.parts().empty()) {
    return html +
           "<p>The record holds no table of points: the comparison has not come to its end. The command that is told "
           "below, run again, renders the units that are missing.</p></section>\n";
  }
  html +=
      "<p>Both axes are logarithmic where the measure allows it. Bands are 95 % intervals of the mean over seeds; a "
      "mode "
      "without bands has fewer than five seeds, or seeds that allow no interval.</p>\n";
  html += selection(data) + legend(data);
  for (const MeasuredPart& part : data.parts()) html += part_section(data, part);
  return html + "</section>\n";
}

std::string speed_section(const ReportData& data) {
  if (data.parts().empty()) return {};
  std::string html = "<section id=\"speed\"><h2>Speed</h2>\n<div class=\"tables\">";
  html += ratio_table(data, pb::CompareRatio::KIND_SPEED, {});
  html += point_table(data, "<strong>Seconds</strong> of wall time for a view, mean over seeds with its 95 % interval.",
                      [](const pb::ComparePoint& point) -> std::optional<PointCell> {
                        return PointCell{&point.seconds(), false, point.disturbed() > 0};
                      });
  return html + "</div></section>\n";
}

}  // namespace helio::report
