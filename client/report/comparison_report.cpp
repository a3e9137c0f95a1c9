#include "client/report/comparison_report.h"

#include <string_view>

#include "client/report/answer_section.h"
#include "client/report/html_text.h"
#include "client/report/line_plot.h"
#include "client/report/measure_section.h"
#include "client/report/pacing_section.h"
#include "client/report/page_parts.h"
#include "client/report/pictures/picture_section.h"
#include "client/report/repeat_section.h"
#include "client/report/report_data.h"
#include "renderer/codec/sha256.h"

namespace helio {
namespace {

// As a Content-Security-Policy names a script or style by its text.
std::string hash_source(std::string_view text) {
  Sha256 hash;
  hash.update(text);
  const Sha256Digest digest = hash.finish();
  return "'sha256-" + report::base64(digest) + "'";
}

}  // namespace

std::string comparison_report(const heliograph::v1::CompareRecord& record, const std::filesystem::path& folder) {
  const report::ReportData data(record);
  const std::string style = std::string(report::page_style()) + report::plot_style(data.modes(), true);
  const std::string script(report::page_script());
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src " +
      hash_source(style) + "; script-src " + hash_source(script) +
      "; base-uri 'none'; form-action 'none'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
      report::escaped(report::report_title(data)) + "</title>\n<style>" + style + "</style>\n</head>\n<body>\n" +
      "<svg class=\"markers\" width=\"0\" height=\"0\" aria-hidden=\"true\">" + report::plot_markers(data.modes()) +
      "</svg>\n<main>\n";
  html += report::answer_section(data);
  html += report::measure_section(data);
  html += report::speed_section(data);
  html += report::picture_section(data, folder);
  html += report::pacing_section(data);
  html += report::repeat_section(data);
  return html + "</main>\n<script>" + script + "</script>\n</body>\n</html>\n";
}

}  // namespace helio
