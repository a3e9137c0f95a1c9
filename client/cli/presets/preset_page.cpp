#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "client/cli/presets/preset_output.h"
#include "client/report/html_text.h"
#include "client/report/number_text.h"
#include "client/report/page_frame.h"

namespace helio::cli {

namespace {

using report::escaped;

constexpr const char* kStyle =
    ".preset th,.preset td{padding-right:10px}.preset thead th,.preset tbody th,.preset td{white-space:normal}\n"
    ".preset td,.preset td::first-line{font-size:13px}.preset td i{white-space:normal;font-size:12px;min-width:8ch}\n"
    ".preset .remark{min-width:16ch;color:var(--quiet)}\n"
    "@media print{@page{size:landscape;margin:10mm}.preset th,.preset td{padding-right:6px}\n"
    ".preset td,.preset td::first-line,.preset th{font-size:8.5px}.preset td i{font-size:8px}}\n";

std::string cell(double value, const std::string& below = "", const std::string& marks = "") {
  if (!std::isfinite(value)) return "<td>–";
  const std::string raised = marks.empty() ? "" : "<sup>" + marks + "</sup>";
  return "<td>" + report::number(value) + raised + (below.empty() ? "" : "<i>" + escaped(below) + "</i>");
}

std::string cell(const std::optional<pb::CompareInterval>& interval, const std::string& marks = "") {
  return interval ? cell(interval->mean(), report::interval_text(*interval), marks) : "<td>–";
}

std::string marks_of_ours(const PresetRow& row) {
  return row.few_pixels ? "p" : row.disturbed && is_of_time(row.measure) ? "d" : "";
}

std::string marks_of_ratio(const PresetRow& row) {
  return row.ratio_few_pixels ? "p" : row.ratio_disturbed && is_of_time(row.measure) ? "d" : "";
}

std::string row_html(const PresetRow& row, const Experiment& experiment) {
  std::string html = "<tr><th scope=\"row\">" + escaped(row.mode);
  if (!row.view.empty()) html += " (" + escaped(row.view) + ")";
  html += "<td>" + (row.our_mode.empty() ? "none" : escaped(row.our_mode));
  html += "<td>" + (row.samples > 0 ? std::to_string(row.samples) : std::string("–"));
  html += "<td>" + escaped(row.measure);
  if (row.published) {
    html += cell(row.published->value, row.published->place) + cell(row.published->seconds);
  } else {
    html += "<td>" + (experiment.graph.empty() ? std::string("–") : "graph, " + escaped(experiment.graph)) + "<td>–";
  }
  if (row.remark.empty()) {
    html += cell(row.ours, marks_of_ours(row)) + cell(row.seconds, row.disturbed ? "d" : "");
  } else {
    html += "<td colspan=\"2\" class=\"remark\">" + escaped(row.remark);
  }
  html += "<td>" + (row.baseline_samples > 0 ? std::to_string(row.baseline_samples) : std::string("–"));
  html += cell(row.published_ratio) + cell(row.ratio, marks_of_ratio(row));
  html += cell(row.published_seconds_ratio) + cell(row.seconds_ratio, row.ratio_disturbed ? "d" : "");
  return html + "\n";
}

std::string machine(const pb::CompareRecord& record) {
  if (record.request().modes().empty() || record.calls().empty()) return {};
  const pb::RenderSettings& settings = record.request().modes(0).settings();
  const auto& call = record.calls(record.calls_size() - 1);
  std::string text =
      fmt::format("Ours: {}, {}x{}, {}, {} ({}), {}",
                  call.processor().empty() ? "a processor whose name is not known" : call.processor(), settings.width(),
                  settings.height(), report::counted(record.request().seeds(), "seed"), call.version(), call.isa(),
                  report::counted(std::uint64_t(std::max(0, call.threads())), "thread"));
  if (!record.references().empty()) {
    std::uint32_t most = 0;
    for (const auto& reference : record.references()) most = std::max(most, reference.samples());
    text += fmt::format("; reference of {} samples at most", most);
  }
  return text + ".";
}

std::string experiment_html(const PresetResult& result) {
  const Experiment& experiment = result.experiment;
  std::string html = "<h2>" + escaped(experiment.scene) + "</h2>\n<p class=\"scope\">" +
                     (result.record ? "Rendered: " : "Not rendered: ") + escaped(stand_in_text(result)) + ".";
  if (result.record) {
    html += " " + escaped(machine(*result.record)) + " <a href=\"" + escaped(result.folder) +
            "/report.html\">Report of this comparison</a>.";
  }
  html += "</p>\n";
  if (!experiment.finding.empty()) html += "<p><strong>The paper:</strong> " + escaped(experiment.finding) + "</p>\n";
  if (!result.problem.empty()) html += "<p class=\"warning\">" + escaped(result.problem) + "</p>\n";
  html +=
      "<figure class=\"table\"><table class=\"points preset\"><thead><tr><th scope=\"col\" rowspan=\"2\">mode<th "
      "scope=\"col\" rowspan=\"2\">ours<th scope=\"col\" rowspan=\"2\">samples<th scope=\"col\" "
      "rowspan=\"2\">measure<th colspan=\"2\">published<th colspan=\"2\">measured here [95 %]<th colspan=\"3\">over "
      "the first mode [95 %]<th colspan=\"2\">its time over the first mode's [95 %]<tr><th scope=\"col\">value<th "
      "scope=\"col\">seconds<th scope=\"col\">value<th scope=\"col\">seconds<th scope=\"col\">that has samples<th "
      "scope=\"col\">published<th scope=\"col\">measured<th scope=\"col\">published<th "
      "scope=\"col\">measured<tbody>\n";
  bool pixels = false, disturbed = false;
  for (const PresetRow& row : result.rows) {
    html += row_html(row, experiment);
    pixels |= row.few_pixels || row.ratio_few_pixels;
    disturbed |= row.disturbed || row.ratio_disturbed;
  }
  html += "</table>";
  if (pixels) html += "<p class=\"note\">p: " + std::string(kFewPixelsNote) + "</p>";
  if (disturbed) html += "<p class=\"note\">d: " + std::string(kDisturbedNote) + "</p>";
  return html + "</figure>\n";
}

std::string disturbed_warning(const std::vector<PresetResult>& results) {
  std::uint64_t disturbed = 0, all = 0;
  std::string where;
  for (const PresetResult& result : results) {
    const auto [some, there] = disturbed_units(result);
    disturbed += some;
    all += there;
    if (some > 0) where += fmt::format("{}{} of {}", where.empty() ? "" : ", ", some, result.experiment.name);
  }
  if (disturbed == 0) return {};
  return fmt::format(
      "<p class=\"warning\" role=\"note\"><strong>Disturbed.</strong> While {} of {} pictures were rendered, other "
      "programs used more than 5 % of the processor time that was there ({}). Their seconds are not those of an idle "
      "machine, and ratios of time are uncertain. Errors at equal samples are not touched.</p>\n",
      disturbed, all, escaped(where));
}

}  // namespace

std::string preset_page(const Preset& preset, const std::vector<PresetResult>& results) {
  std::string body = "<header><h1>" + escaped(preset.paper) +
                     "</h1>\n<p class=\"scope\">Published figures beside those "
                     "of this machine. Published: " +
                     escaped(preset.hardware) + ".</p>\n" + disturbed_warning(results) +
                     "<p class=\"answer\">The machines and the sizes of the pictures differ, so that ratios to "
                     "the first mode can be compared and single figures cannot.</p></header>\n<ul>\n";
  for (const std::string& note : preset.notes) body += "<li>" + escaped(note) + "\n";
  body += "</ul>\n";
  for (const PresetResult& result : results) body += experiment_html(result);
  return report::page_frame("Preset " + preset.name + ": " + preset.paper, kStyle, "", body, "");
}

}  // namespace helio::cli
