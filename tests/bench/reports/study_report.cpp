#include "tests/bench/reports/study_report.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "tests/bench/reports/statistics.h"

namespace helio::bench {

namespace {

using nlohmann::ordered_json;

struct Measure {
  const char* name;   // in JSON
  const char* title;  // in tables
  Interval CurvePointReport::*value;
};
constexpr Measure kMeasures[] = {
    {"distance_variance", "var. of distance", &CurvePointReport::distance_variance},
    {"mse", "mse", &CurvePointReport::mse},
    {"relmse", "relMSE", &CurvePointReport::relmse},
    {"dark_relmse", "relMSE, dark half", &CurvePointReport::dark_relmse},
};

ordered_json number(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

template <class T>
ordered_json optional_number(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

std::string cell(double value, const char* format = "{:.2f}") {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "-";
}

template <class T>
std::string optional_cell(const std::optional<T>& value) {
  return value ? fmt::format("{}", *value) : "-";
}

std::string row(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const std::string& content : cells) text += " " + content + " |";
  return text + "\n";
}

std::string header(const std::vector<std::string>& titles) {
  return row(titles) + row(std::vector<std::string>(titles.size(), "---"));
}

// At the last point, over the scenes where the ratio is known.
std::vector<double> ratios_of_scenes(const StudyReport& report, std::size_t setting, const Measure& measure) {
  std::vector<double> ratios;
  for (const StudyResult& result : report.results) {
    const double ratio = over_plain(result, setting, result.curves[setting].points.size() - 1, measure.value);
    if (std::isfinite(ratio)) ratios.push_back(ratio);
  }
  return ratios;
}

std::string summary_table(const StudyReport& report) {
  std::vector<std::string> titles = {"setting", "min", "max", "least probability (paper)"};
  for (const Measure& measure : kMeasures) titles.push_back(std::string(measure.title) + ", median (worst)");
  std::string text = header(titles);
  for (std::size_t s = 1; s < report.settings.size(); ++s) {
    const StudySetting& setting = report.settings[s];
    std::vector<std::string> cells = {setting.name, optional_cell(setting.min_samples),
                                      optional_cell(setting.max_samples), optional_cell(setting.paper_probability)};
    for (const Measure& measure : kMeasures) {
      const std::vector<double> ratios = ratios_of_scenes(report, s, measure);
      cells.push_back(ratios.empty() ? "-"
                                     : fmt::format("{:.2f} ({:.2f})", median(ratios),
                                                   *std::max_element(ratios.begin(), ratios.end())));
    }
    text += row(cells);
  }
  return text;
}

std::string scene_table(const StudyReport& report, const StudyResult& result) {
  const CurvePointReport& plain = result.curves[0].points.back();
  std::string text = fmt::format("\n## {}\n\n{}. Paper: {}.\n\n", result.scene.name, result.scene.property,
                                 result.scene.paper.empty() ? "nothing" : result.scene.paper);
  text += fmt::format(
      "Plain, {} samples, {} seeds: {:.3g} s, variance of distance {:.3g}, mse {:.3g}, relMSE {:.3g}, of the dark half "
      "{}; the reference's noise adds {:.2g} to mse.\n\n",
      plain.samples, plain.seeds, plain.seconds.mean, plain.distance_variance.mean, plain.mse.mean, plain.relmse.mean,
      cell(plain.dark_relmse.mean, "{:.3g}"), result.curves[0].reference_mse);
  std::vector<std::string> titles = {"setting"};
  for (const CurvePointReport& point : result.curves[0].points) {
    titles.push_back(fmt::format("{} at {}", kMeasures[0].title, point.samples));
  }
  for (const Measure& measure : kMeasures) {
    if (&measure != &kMeasures[0]) titles.push_back(measure.title);
  }
  titles.insert(titles.end(), {"bias %", "bias of dark half %"});
  text += header(titles);
  for (std::size_t s = 0; s < report.settings.size(); ++s) {
    const std::vector<CurvePointReport>& points = result.curves[s].points;
    std::vector<std::string> cells = {report.settings[s].name};
    for (std::size_t p = 0; p < points.size(); ++p) cells.push_back(cell(over_plain(result, s, p, kMeasures[0].value)));
    for (const Measure& measure : kMeasures) {
      if (&measure != &kMeasures[0]) cells.push_back(cell(over_plain(result, s, points.size() - 1, measure.value)));
    }
    cells.push_back(cell(100 * points.back().bias, "{:+.2f}"));
    cells.push_back(cell(100 * points.back().dark_bias.mean, "{:+.2f}"));
    text += row(cells);
  }
  return text;
}

}  // namespace

double over_plain(const StudyResult& result, std::size_t setting, std::size_t point,
                  Interval CurvePointReport::*measure) {
  const CurvePointReport& at = result.curves.at(setting).points.at(point);
  if (setting == 0) return (at.*measure).mean > 0 ? 1 : std::numeric_limits<double>::quiet_NaN();
  return (at.*measure).mean / value_at(result.curves.at(0), measure, at.seconds.mean);
}

std::string to_json(const StudyReport& report) {
  ordered_json settings = ordered_json::array(), scenes = ordered_json::array();
  for (const StudySetting& setting : report.settings) {
    settings.push_back({{"name", setting.name},
                        {"min_samples", optional_number(setting.min_samples)},
                        {"max_samples", optional_number(setting.max_samples)},
                        {"paper_probability", optional_number(setting.paper_probability)}});
  }
  for (const StudyResult& result : report.results) {
    ordered_json curves = ordered_json::parse(to_json(std::span<const CurveReport>(result.curves))).at("curves");
    for (std::size_t s = 0; s < curves.size(); ++s) {
      ordered_json ratios = ordered_json::array();
      for (std::size_t p = 0; p < result.curves[s].points.size(); ++p) {
        ordered_json of_point = ordered_json::object();
        for (const Measure& measure : kMeasures) {
          of_point[measure.name] = number(over_plain(result, s, p, measure.value));
        }
        ratios.push_back(of_point);
      }
      curves[s]["over_plain"] = ratios;
    }
    scenes.push_back({{"scene", result.scene.name},
                      {"property", result.scene.property},
                      {"paper", result.scene.paper},
                      {"curves", curves}});
  }
  return ordered_json({{"title", report.title}, {"settings", settings}, {"scenes", scenes}}).dump(2);
}

std::string to_markdown(const StudyReport& report) {
  std::string text =
      "# " + report.title + "\n\n" +
      "Ratios to plain path tracing in the same time, below 1 is better; in the first table at the last point, over "
      "all scenes. Against references of 4,096 samples.\n\n";
  text += summary_table(report);
  for (const StudyResult& result : report.results) text += scene_table(report, result);
  return text;
}

}  // namespace helio::bench
