#include "client/report/pacing_section.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "client/report/html_text.h"
#include "client/report/line_plot.h"
#include "client/report/number_text.h"

namespace helio::report {
namespace {

constexpr int kBins = 28;
constexpr double kWidth = 560, kHeight = 70, kLeft = 6, kAxis = 20;

struct Pace {
  std::size_t mode;
  double budget_ms;
  std::vector<double> milliseconds;  // sorted
};

std::vector<Pace> paces_of(const ReportData& data) {
  std::vector<Pace> all;
  for (std::size_t mode = 0; mode < data.modes(); ++mode) {
    const pb::CompareMode& compared = data.request().modes(int(mode));
    if (compared.picture() != pb::COMPARED_PICTURE_PREVIEW) continue;
    Pace pace{mode, compared.settings().preview_budget_ms(), {}};
    for (const pb::CompareUnit& unit : data.record().units()) {
      if (unit.mode() == compared.name() && unit.view() > 0) pace.milliseconds.push_back(1000 * unit.seconds());
    }
    if (pace.milliseconds.empty()) continue;
    std::sort(pace.milliseconds.begin(), pace.milliseconds.end());
    all.push_back(std::move(pace));
  }
  return all;
}

std::string flicker_text(const ReportData& data, std::size_t mode) {
  const auto& points = data.points_of(mode);
  if (points.empty()) return "not measured";
  const auto* value = value_of(*points.back(), {pb::COMPARE_MEASURE_FLICKER, ""});
  if (!value) return "not measured";
  const std::string interval = value->value().known()     ? interval_text(value->value())
                               : data.has_few_seeds(mode) ? "no interval: fewer than five seeds"
                                                          : "no interval: the seeds allow none";
  return number(value->value().mean()) + " <i>" + interval + "</i>";
}

std::string row_of(const ReportData& data, const Pace& pace) {
  const std::vector<double>& ms = pace.milliseconds;
  const double mean = std::accumulate(ms.begin(), ms.end(), 0.0) / double(ms.size());
  std::string within = "no budget is told";
  if (pace.budget_ms > 0) {
    const auto late = ms.end() - std::upper_bound(ms.begin(), ms.end(), pace.budget_ms);
    within = fmt::format("{} of {} above {} ms", late, ms.size(), plain_number(pace.budget_ms));
  }
  return fmt::format("<tr><th scope=\"row\">{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}\n",
                     escaped(data.mode_name(pace.mode)), ms.size(), number(mean), number(percentile(ms, 0.5)),
                     number(percentile(ms, 0.95)), number(percentile(ms, 0.99)), number(ms.back()), within,
                     flicker_text(data, pace.mode));
}

// The histogram of one mode, over the same logarithmic range as the others.
std::string histogram(const ReportData& data, const Pace& pace, double first, double last) {
  std::vector<int> counts(kBins);
  for (const double ms : pace.milliseconds) {
    const double share = ms > 0 ? (std::log10(ms) - first) / (last - first) : 0;
    ++counts[std::size_t(std::clamp(int(share * kBins), 0, kBins - 1))];
  }
  const int most = *std::max_element(counts.begin(), counts.end());
  const double bin = (kWidth - 2 * kLeft) / kBins;
  std::string bars;
  for (int i = 0; i < kBins; ++i) {
    if (counts[std::size_t(i)] == 0) continue;
    const double height = std::max(1.0, (kHeight - kAxis) * counts[std::size_t(i)] / most);
    bars += fmt::format("<path class=\"bin\" d=\"M{:.1f} {:.1f}v{:.1f}h{:.1f}v{:.1f}z\"/>", kLeft + i * bin,
                        kHeight - kAxis, -height, bin - 1, height);
  }
  std::string labels;
  for (const double share : {0.0, 0.5, 1.0}) {
    labels += fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" text-anchor=\"{}\">{} ms</text>",
                          kLeft + share * (kWidth - 2 * kLeft), kHeight - 4,
                          share == 0   ? "start"
                          : share == 1 ? "end"
                                       : "middle",
                          number(std::pow(10, first + share * (last - first))));
  }
  return fmt::format(
      "<figure class=\"histogram\"><figcaption>{0}</figcaption><svg role=\"img\" aria-label=\"Histogram of preview "
      "times of "
      "{0}\" viewBox=\"0 0 {1:.0f} {2:.0f}\"><g class=\"{3}\">{4}</g><g class=\"ticks\">{5}</g></svg></figure>\n",
      escaped(data.mode_name(pace.mode)), kWidth, kHeight, series_class(pace.mode), bars, labels);
}

}  // namespace

double percentile(const std::vector<double>& sorted, double share) {
  const double rank = std::ceil(share * double(sorted.size()) - 1e-9);
  return sorted[std::size_t(std::clamp(rank, 1.0, double(sorted.size()))) - 1];
}

std::string pacing_section(const ReportData& data) {
  const std::vector<Pace> paces = paces_of(data);
  if (paces.empty()) return {};
  std::string html =
      "<section id=\"pacing\"><h2>Pacing of previews</h2>\n<p>Milliseconds from a view to its whole preview, of all "
      "seeds, budgets and "
      "views but the first, which is rendered to the budget.</p>\n<figure class=\"table\"><table><thead><tr><th "
      "scope=\"col\">mode<th "
      "scope=\"col\">previews<th scope=\"col\">mean, ms<th scope=\"col\">p50<th scope=\"col\">p95<th "
      "scope=\"col\">p99<th scope=\"col\">max<th "
      "scope=\"col\">late<th scope=\"col\">flicker<tbody>\n";
  double least = paces[0].milliseconds.front(), most = paces[0].milliseconds.back();
  for (const Pace& pace : paces) {
    html += row_of(data, pace);
    least = std::min(least, pace.milliseconds.front());
    most = std::max(most, pace.milliseconds.back());
  }
  html += "</table></figure>\n<div>";
  const double first = std::log10(std::max(1e-3, least)),
               last = std::max(first + 0.1, std::log10(std::max(1e-3, most)));
  for (const Pace& pace : paces) html += histogram(data, pace, first, last);
  return html + "</div></section>\n";
}

}  // namespace helio::report
