#include "client/report/pictures/worst_pixels.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "client/report/html_text.h"
#include "client/report/number_text.h"

namespace helio::report {
namespace {

constexpr int kMostPixels = 8;  // of a mode

std::string color_text(const pb::Vec3& color) {
  return number(color.x()) + ", " + number(color.y()) + ", " + number(color.z());
}

std::string row_of(const std::string& mode, const pb::ComparePixel& pixel) {
  const std::string replay = pixel.replay_token().empty() ? "no single sample of it can be traced again"
                                                          : "<code class=\"copy\">heliograph replay " +
                                                                escaped(pixel.replay_token()) + "</code>";
  return fmt::format(
      "<tr><th scope=\"row\">{}<td><span class=\"place\" data-x=\"{}\" data-y=\"{}\">{}, "
      "{}</span><td>{}&#8239;%<td>{}<td>{}<td>{}\n",
      escaped(mode), pixel.x(), pixel.y(), pixel.x(), pixel.y(), number(100 * pixel.share()),
      color_text(pixel.picture()), color_text(pixel.reference()), replay);
}

}  // namespace

std::string worst_pixels(const ReportData& data, std::optional<std::uint32_t> view) {
  std::string rows;
  for (std::size_t mode = 0; mode < data.modes(); ++mode) {
    const pb::CompareUnit* best = nullptr;
    for (const pb::CompareUnit& unit : data.record().units()) {
      if (unit.mode() != data.mode_name(mode) || unit.seed_number() != 1 || unit.worst_size() == 0) continue;
      if (view && unit.view() != *view) continue;
      if (!best || unit.budget() > best->budget()) best = &unit;
    }
    if (!best) continue;
    for (int i = 0; i < std::min(kMostPixels, best->worst_size()); ++i)
      rows += row_of(data.mode_name(mode), best->worst(i));
  }
  if (rows.empty()) return {};
  return "<figure class=\"table\"><figcaption><strong>Worst pixels</strong> Those with the largest squared relative "
         "error of the first seed at the last budget, with the share of it that they have. The command traces the "
         "pixel's "
         "brightest sample again.</figcaption><table class=\"worst\"><thead><tr><th scope=\"col\">mode<th "
         "scope=\"col\">x, y<th scope=\"col\">share<th scope=\"col\">"
         "picture R, G, B<th scope=\"col\">reference R, G, B<th scope=\"col\">replay<tbody>\n" +
         rows + "</table></figure>\n";
}

}  // namespace helio::report
