#include "client/report/answer_section.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "client/report/html_text.h"
#include "client/report/number_text.h"
#include "client/report/ratio_table.h"

namespace helio::report {
namespace {

constexpr int kMostViews = 12;  // whose references are told one by one

// The first sentence is the answer, the others say what it rests on.
std::string answer(const ReportData& data) {
  const auto& sentences = data.record().table().sentences();
  if (!sentences.empty()) {
    std::string html = "<p class=\"answer\">" + escaped(sentences[0]) + "</p>\n", others;
    for (int i = 1; i < sentences.size(); ++i) others += "<li>" + escaped(sentences[i]) + "\n";
    return others.empty() ? html : html + "<ul class=\"sentences\">" + others + "</ul>\n";
  }
  if (!data.record().has_table()) {
    return "<p class=\"answer\">The comparison has not come to its end, so there is no answer yet.</p>\n";
  }
  return "<p class=\"answer\">The table of the comparison says nothing in words; see the ratios below.</p>\n";
}

std::string scope(const ReportData& data) {
  const pb::CompareRequest& request = data.request();
  std::string size;
  if (data.modes() > 0) {
    size = fmt::format(" at {} × {} pixels", request.modes(0).settings().width(), request.modes(0).settings().height());
  }
  return fmt::format(
      "<p class=\"scope\">{}, {} of each, {}, {}{}. The others are compared with <strong>{}</strong>.</p>\n",
      counted(data.modes(), "mode"), counted(request.seeds(), "seed"), counted(data.budgets(), "budget"),
      counted(std::uint64_t(std::max(1, request.views_size())), "view"), size, escaped(data.baseline()));
}

std::string disturbed_warning(const ReportData& data) {
  std::string modes;
  std::uint64_t there = 0;
  for (std::size_t mode = 0; mode < data.modes(); ++mode) {
    there += data.units_of(mode).there;
    if (data.units_of(mode).disturbed == 0) continue;
    modes += fmt::format("{}{} of {}", modes.empty() ? "" : ", ", data.units_of(mode).disturbed,
                         escaped(data.mode_name(mode)));
  }
  if (data.disturbed() == 0) return {};
  return fmt::format(
      "<p class=\"warning\" role=\"note\"><strong>Disturbed.</strong> While {} of {} units were rendered, other "
      "programs used "
      "more than 5 % of the processor time that was there ({}). Their seconds are not those of an idle machine, and "
      "ratios of time are uncertain. Errors at equal samples are not touched.</p>\n",
      data.disturbed(), there, modes);
}

std::string other_warnings(const ReportData& data) {
  std::string html;
  const auto warn = [&](const std::string& title, const std::string& text) {
    html += "<p class=\"warning\" role=\"note\"><strong>" + title + "</strong> " + text + "</p>\n";
  };
  std::uint64_t expected = 0, there = 0, invalid = 0;
  bool few = false;
  for (std::size_t mode = 0; mode < data.modes(); ++mode) {
    expected += data.units_of(mode).expected;
    there += data.units_of(mode).there;
    invalid += data.units_of(mode).invalid_samples;
    few |= data.has_few_seeds(mode);
  }
  if (there < expected)
    warn("Incomplete.",
         fmt::format("{} of {} units are missing; the last section lists them.", expected - there, expected));
  for (const auto& call : data.record().calls()) {
    for (const std::string& difference : call.differences()) warn("Mixed.", escaped(difference));
  }
  if (few && data.record().has_table()) {
    warn("Few seeds.", "Below five seeds there are no intervals, and every ratio is undecided.");
  }
  if (invalid > 0)
    warn("Invalid samples.", counted(invalid, "sample") + " that came out infinite or not a number were left out.");
  return html;
}

std::string noise_text(const pb::CompareResponse::Reference& reference) {
  // One sample per half, or a black picture, tells nothing.
  if (reference.noise() != pb::CompareResponse::Reference::NOISE_UNSPECIFIED && !(reference.error() > 0))
    return "how much noise it has could not be told, so that it may be contained in all errors";
  switch (reference.noise()) {
    case pb::CompareResponse::Reference::NOISE_HALVES:
      return "its noise is known from two independent halves and taken off MSE and relative MSE";
    case pb::CompareResponse::Reference::NOISE_VARIANCE:
      return "its noise is known from its variance and taken off MSE and relative MSE";
    default:
      return "its noise is not known and is contained in all errors";
  }
}

std::string reference_item(const pb::CompareResponse::Reference& reference) {
  std::string text = fmt::format("View {}: ", reference.view());
  text +=
      reference.samples() > 0 ? counted(reference.samples(), "sample") + " per pixel" : "number of samples not known";
  text +=
      reference.error() > 0 ? ", root of its own relative MSE " + number(reference.error()) : ", own error not known";
  if (reference.seconds() > 0 && !reference.kept()) text += ", rendered in " + number(reference.seconds()) + " s";
  if (reference.kept() && reference.samples() > 0) text += ", kept from an earlier comparison";
  if (reference.rendered_again()) text += ", rendered again after the daemon had let it go";
  return "<li>" + text + "; " + noise_text(reference) + ".\n";
}

std::string references(const ReportData& data) {
  const pb::CompareRecord& record = data.record();
  std::string html = "<h2>Reference</h2>\n<p>";
  const pb::CompareReference& asked = data.request().reference();
  if (record.reference_files_size() > 0 || asked.has_loaded()) {
    html += "Loaded from " + counted(std::uint64_t(record.reference_files_size()), "file") + ".";
  } else if (asked.has_rendered()) {
    const auto& rendered = asked.rendered();
    html += fmt::format(
        "Rendered first, until its own relative error (the root of its relative MSE) was {} or it had {} samples per "
        "pixel.",
        rendered.error() > 0 ? plain_number(rendered.error()) : "0.01",
        rendered.max_samples() > 0 ? rendered.max_samples() : 65536u);
  } else {
    html += "Rendered first, with the daemon's defaults.";
  }
  html += "</p>\n";
  if (record.references_size() == 0) return html + "<p>No reference is there yet.</p>\n";
  html += "<ul>";
  for (int i = 0; i < std::min(kMostViews, record.references_size()); ++i) html += reference_item(record.references(i));
  html += "</ul>\n";
  if (record.references_size() > kMostViews) {
    html += fmt::format("<p class=\"note\">The first {} of {} views; the record has all.</p>\n", kMostViews,
                        record.references_size());
  }
  return html;
}

}  // namespace

std::string report_title(const ReportData& data) {
  const pb::CompareRecord& record = data.record();
  const std::string& name = !record.scene_name().empty() ? record.scene_name() : record.scene_file();
  return "Sampling modes compared" + (name.empty() ? std::string() : ": " + name) +
         (record.table().partial() ? " (partial)" : "");
}

std::string answer_section(const ReportData& data) {
  return "<header><h1>" + escaped(report_title(data)) + "</h1>\n" + scope(data) + disturbed_warning(data) +
         answer(data) + other_warnings(data) + "</header>\n<section id=\"answer\">" + glance_table(data) +
         references(data) + "</section>\n";
}

}  // namespace helio::report
