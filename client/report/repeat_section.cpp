#include "client/report/repeat_section.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <span>

#include "client/report/html_text.h"
#include "client/report/number_text.h"
#include "client/report/settings_table.h"
#include "renderer/codec/sha256.h"

namespace helio::report {
namespace {

std::string code(const std::string& text) {
  return "<code class=\"copy\">" + escaped(text) + "</code>";
}

std::string call_item(const pb::CompareRecord::Call& call) {
  std::string html =
      "<li>" + (call.command_line().empty() ? std::string("A call that no command made.") : code(call.command_line()));
  html += fmt::format(
      "<br>Begun {}; {} rendered in {} s{}. heliographd {}, build {}, instruction path {}, {}{}.",
      call.begun().empty() ? "at an unknown time" : escaped(call.begun()), counted(call.units(), "unit"),
      number(call.seconds()), call.ended() ? "" : ", interrupted or not yet ended",
      call.version().empty() ? "of unknown version" : escaped(call.version()),
      call.build().empty() ? "unknown" : escaped(call.build()), call.isa().empty() ? "unknown" : escaped(call.isa()),
      counted(std::uint64_t(std::max(0, call.threads())), "thread"),
      call.processor().empty() ? "" : ", " + escaped(call.processor()));
  for (const std::string& difference : call.differences())
    html += "<br><strong>Differs:</strong> " + escaped(difference);
  return html + "\n";
}

std::string row(const std::string& title, const std::string& html) {
  return "<tr><th scope=\"row\">" + title + "<td>" + html + "\n";
}

std::string references(const ReportData& data) {
  std::string html;
  const pb::CompareRecord& record = data.record();
  for (const auto& reference : record.references()) {
    if (reference.reference_id().empty()) continue;
    html += (html.empty() ? "" : "<br>") + fmt::format("view {}: {}", reference.view(), code(reference.reference_id()));
  }
  for (int i = 0; i < record.reference_files_size(); ++i) {
    const std::string& hash = record.reference_files(i).sha256();
    html += (html.empty() ? "" : "<br>") +
            fmt::format("view {}: file {}, SHA-256 {}", i, code(record.reference_files(i).path()),
                        code(to_hex(std::span(reinterpret_cast<const std::uint8_t*>(hash.data()), hash.size()))));
  }
  return html.empty() ? "none yet" : html;
}

std::string budgets(const ReportData& data) {
  std::string text;
  for (std::uint32_t i = 0; i < data.budgets(); ++i) {
    text += (text.empty() ? "" : ", ") +
            plain_number(data.budgets_are_seconds() ? data.request().times_s(int(i)) : data.request().samples(int(i)));
  }
  if (text.empty()) return "none";
  return text + (data.budgets_are_seconds() ? " seconds of wall time a view" : " samples per pixel");
}

std::string unit_rows(const ReportData& data) {
  std::string html;
  for (std::size_t mode = 0; mode < data.modes(); ++mode) {
    const UnitCount& count = data.units_of(mode);
    std::string missing = "none";
    if (count.there < count.expected) {
      missing = counted(count.expected - count.there, "unit") + ": ";
      for (std::size_t i = 0; i < count.missing.size(); ++i) {
        const auto& unit = count.missing[i];
        missing += fmt::format("{}seed {} at {}{}", i == 0 ? "" : "; ", unit.seed_number, data.budget_text(unit.budget),
                               data.is_path() ? fmt::format(", view {}", unit.view + 1) : "");
      }
      if (count.expected - count.there > count.missing.size()) missing += "; …";
    }
    html += fmt::format("<tr><th scope=\"row\">{}<td>{} of {}<td>{}<td>{}<td>{}\n", escaped(data.mode_name(mode)),
                        count.there, count.expected, count.disturbed, count.invalid_samples, missing);
  }
  return html;
}

}  // namespace

std::string repeat_section(const ReportData& data) {
  const pb::CompareRecord& record = data.record();
  const pb::CompareRequest& request = data.request();
  std::string html = "<section id=\"repeat\"><h2>To repeat this comparison</h2>\n";
  if (record.calls_size() == 0) {
    html += "<p>The record does not tell by which command it was made.</p>\n";
  } else {
    html += "<ol class=\"calls\">\n";
    for (const auto& call : record.calls()) html += call_item(call);
    html += "</ol>\n";
  }
  html += "<figure class=\"table\"><table class=\"facts\"><tbody>\n";
  html += row("scene", escaped(record.scene_name().empty() ? "without a name" : record.scene_name()) +
                           (record.scene_file().empty() ? "" : ", file " + code(record.scene_file())) + ", id " +
                           code(request.scene_id()));
  html += row("seeds", fmt::format("{} of each mode, from {} on; {}", request.seeds(), request.first_seed(),
                                   request.common_seeds() ? "modes have the same seeds, and ratios are paired by seed"
                                                          : "each mode has seeds of its own"));
  html += row("budgets", budgets(data));
  html += row("rendering alone", request.exclusive() ? "yes: nothing else was rendered while a mode's turn lasted"
                                                     : "no: other sessions may have had their share");
  html += row("references", references(data));
  html +=
      "</table></figure>\n<figure class=\"table\"><figcaption><strong>Units</strong> A unit is the picture of one "
      "mode, seed, "
      "budget and view.</figcaption><table><thead><tr><th scope=\"col\">mode<th scope=\"col\">units<th "
      "scope=\"col\">disturbed<th scope=\"col\">invalid "
      "samples<th scope=\"col\">missing<tbody>\n" +
      unit_rows(data) + "</table></figure>\n";
  html += settings_table(data);
  if (record.notices_size() > 0) {
    html += "<h3>Notices of the daemon</h3><ul>";
    for (const std::string& notice : record.notices()) html += "<li>" + escaped(notice);
    html += "</ul>\n";
  }
  return html + "</section>\n";
}

}  // namespace helio::report
