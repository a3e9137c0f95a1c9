#include "client/report/ratio_table.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "client/report/html_text.h"
#include "client/report/measure_names.h"
#include "client/report/number_text.h"

namespace helio::report {
namespace {

constexpr pb::CompareRatio::Kind kKinds[] = {pb::CompareRatio::KIND_EQUAL_ERROR, pb::CompareRatio::KIND_EQUAL_TIME,
                                             pb::CompareRatio::KIND_EQUAL_SAMPLES, pb::CompareRatio::KIND_SPEED};

bool known_ratio(const pb::CompareRatio& ratio) {
  return std::isfinite(ratio.ratio().mean()) && ratio.ratio().mean() > 0;
}

// True if a ratio may have no interval for want of seeds.
bool few_seeds(const ReportData& data, const pb::CompareRatio& ratio) {
  return data.has_few_seeds(ratio.mode()) || data.has_few_seeds(ratio.baseline());
}

constexpr const char* kFewSeedsNote = "a: no interval, because there are fewer than five seeds.";
constexpr const char* kNothingToSayNote = "b: no interval, because the seeds that are there do not allow one.";

std::string interval_or_note(const ReportData& data, const pb::CompareRatio& ratio) {
  if (ratio.ratio().known()) return interval_text(ratio.ratio());
  return few_seeds(data, ratio) ? "<sup>a</sup>" : "<sup>b</sup>";
}

std::string notes(bool few, bool nothing) {
  std::string text;
  if (few) text += std::string("<p class=\"note\">") + kFewSeedsNote + "</p>";
  if (nothing) text += std::string("<p class=\"note\">") + kNothingToSayNote + "</p>";
  return text;
}

struct VerdictLook {
  const char *word, *sign;
};
VerdictLook look_of(pb::CompareVerdict verdict) {
  switch (verdict) {
    case pb::COMPARE_VERDICT_BETTER:
      return {"better", "▲"};
    case pb::COMPARE_VERDICT_WORSE:
      return {"worse", "▼"};
    default:
      return {"undecided", "◇"};
  }
}

std::string cell(const ReportData& data, const pb::CompareRatio* ratio) {
  if (!ratio) return "<td>–";
  const VerdictLook look = look_of(ratio->verdict());
  if (!known_ratio(*ratio)) return fmt::format("<td class={}>{} not known", look.word[0], look.sign);
  return fmt::format("<td class={}>{} {}<br>{}", look.word[0], look.sign, number(ratio->ratio().mean()),
                     interval_or_note(data, *ratio));
}

// The place of a ratio on an axis from worse (0) through 1 (0.5) to better (1), over `octaves` on either side.
double place(double ratio, bool above_is_better, double octaves) {
  const double good = above_is_better ? std::log2(ratio) : -std::log2(ratio);
  return std::clamp(0.5 + 0.5 * good / octaves, 0.0, 1.0);
}

constexpr double kBarWidth = 220;

std::string interval_bar(const pb::CompareRatio& ratio, double octaves) {
  const bool above = name_of(ratio.kind()).above_is_better;
  const auto at = [&](double value) {
    return value > 0 ? 4 + (kBarWidth - 8) * place(value, above, octaves) : (above ? 4.0 : kBarWidth - 4);
  };
  std::string svg = fmt::format(
      "<svg class=\"bar {}\" width=\"{:.0f}\" height=\"18\" viewBox=\"0 0 {:.0f} 18\" "
      "aria-hidden=\"true\"><path class=\"one\" d=\"M{:.0f} 0v18\"/>",
      look_of(ratio.verdict()).word[0], kBarWidth, kBarWidth, kBarWidth / 2);
  const pb::CompareInterval& interval = ratio.ratio();
  if (interval.known()) {
    const double a = at(interval.low()), b = at(interval.high());
    svg += fmt::format("<path class=\"span\" d=\"M{0:.1f} 9H{1:.1f}M{0:.1f} 4v10M{1:.1f} 4v10\"/>", std::min(a, b),
                       std::max(a, b));
  }
  return svg + fmt::format("<circle cx=\"{:.1f}\" cy=\"9\" r=\"4\"/></svg>", at(interval.mean()));
}

// The ratio of a mode and kind at the hardest point.
const pb::CompareRatio* hardest(const ReportData& data, const std::string& mode, pb::CompareRatio::Kind kind,
                                const MeasuredPart& part) {
  const pb::CompareRatio* best = nullptr;
  for (const pb::CompareRatio& ratio : data.record().table().ratios()) {
    if (ratio.kind() != kind || ratio.mode() != mode) continue;
    if (kind != pb::CompareRatio::KIND_SPEED && MeasuredPart{ratio.measure(), ratio.region()} != part) continue;
    const bool harder =
        !best || (kind == pb::CompareRatio::KIND_EQUAL_ERROR ? ratio.at() < best->at() : ratio.at() > best->at());
    if (harder) best = &ratio;
  }
  return best;
}

// The first part in reading order that there are ratios of.
std::optional<MeasuredPart> main_part(const ReportData& data) {
  for (const MeasuredPart& part : data.parts()) {
    for (const pb::CompareRatio& ratio : data.record().table().ratios()) {
      if (ratio.kind() != pb::CompareRatio::KIND_SPEED && MeasuredPart{ratio.measure(), ratio.region()} == part)
        return part;
    }
  }
  return std::nullopt;
}

// Samples are whole numbers that somebody asked for.
std::string at_number(pb::CompareRatio::Kind kind, double at) {
  const bool samples = kind == pb::CompareRatio::KIND_EQUAL_SAMPLES || kind == pb::CompareRatio::KIND_SPEED;
  return samples ? plain_number(at) : number(at);
}

std::string at_text(const pb::CompareRatio& ratio, const std::string& measure) {
  switch (ratio.kind()) {
    case pb::CompareRatio::KIND_EQUAL_ERROR:
      return "to a " + measure + " of " + number(ratio.at());
    case pb::CompareRatio::KIND_EQUAL_TIME:
      return measure + " after " + number(ratio.at()) + " s";
    case pb::CompareRatio::KIND_EQUAL_SAMPLES:
      return measure + " after " + plain_number(ratio.at()) + " samples";
    default:
      return "time for " + plain_number(ratio.at()) + " samples";
  }
}

}  // namespace

RatioKindName name_of(pb::CompareRatio::Kind kind) {
  switch (kind) {
    case pb::CompareRatio::KIND_EQUAL_ERROR:
      return {"Equal error", "The baseline's time over the mode's to the same error: above 1 the mode is faster.",
              "error", true};
    case pb::CompareRatio::KIND_EQUAL_TIME:
      return {"Equal time", "The mode's error over the baseline's after the same time: below 1 the mode is better.",
              "seconds", false};
    case pb::CompareRatio::KIND_EQUAL_SAMPLES:
      return {"Equal samples",
              "The mode's error over the baseline's after as many samples: below 1 the mode is better.",
              "samples per pixel", false};
    case pb::CompareRatio::KIND_SPEED:
      return {"Speed", "The mode's time over the baseline's for as many samples: below 1 the mode is faster.",
              "samples per pixel", false};
    default:
      return {"Unknown ratio", "A ratio that this version does not know.", "at", false};
  }
}

std::string ratio_table(const ReportData& data, pb::CompareRatio::Kind kind, const MeasuredPart& part) {
  std::map<double, std::map<std::string, const pb::CompareRatio*>> rows;
  bool few = false, nothing = false;
  for (const pb::CompareRatio& ratio : data.record().table().ratios()) {
    if (ratio.kind() != kind) continue;
    if (kind != pb::CompareRatio::KIND_SPEED && MeasuredPart{ratio.measure(), ratio.region()} != part) continue;
    rows[ratio.at()][ratio.mode()] = &ratio;
    if (!ratio.ratio().known() && known_ratio(ratio)) (few_seeds(data, ratio) ? few : nothing) = true;
  }
  if (rows.empty()) return {};
  const RatioKindName name = name_of(kind);
  std::string html = fmt::format(
      "<figure class=\"table\"><figcaption><strong>{}</strong> {} ▲ better, "
      "▼ worse, ◇ undecided.</figcaption><table class=\"ratios\"><thead><tr><th scope=\"col\">{}",
      name.title, name.reading, name.unit);
  for (std::size_t mode = 1; mode < data.modes(); ++mode) html += "<th>" + escaped(data.mode_name(mode));
  html += "<tbody>\n";
  for (const auto& [at, ratios] : rows) {
    html += "<tr><th>" + at_number(kind, at);
    for (std::size_t mode = 1; mode < data.modes(); ++mode) {
      const auto found = ratios.find(data.mode_name(mode));
      html += cell(data, found == ratios.end() ? nullptr : found->second);
    }
    html += "\n";
  }
  return html + "</table>" + notes(few, nothing) + "</figure>\n";
}

std::string glance_table(const ReportData& data) {
  const std::optional<MeasuredPart> part = main_part(data);
  const std::string measure = part ? in_sentence(name_of(part->measure).title) : std::string();
  std::vector<const pb::CompareRatio*> shown;
  for (std::size_t mode = 1; mode < data.modes(); ++mode) {
    for (const pb::CompareRatio::Kind kind : kKinds) {
      if (!part && kind != pb::CompareRatio::KIND_SPEED) continue;
      if (const auto* ratio = hardest(data, data.mode_name(mode), kind, part.value_or(MeasuredPart{})))
        shown.push_back(ratio);
    }
  }
  if (shown.empty()) return {};
  double octaves = 1;
  bool few = false, nothing = false;
  for (const pb::CompareRatio* ratio : shown) {
    const pb::CompareInterval& interval = ratio->ratio();
    for (const double value :
         {interval.mean(), interval.known() ? interval.low() : 1.0, interval.known() ? interval.high() : 1.0}) {
      if (value > 0 && std::isfinite(value)) octaves = std::max(octaves, std::abs(std::log2(value)));
    }
    if (!interval.known() && known_ratio(*ratio)) (few_seeds(data, *ratio) ? few : nothing) = true;
  }
  octaves = std::min(octaves, 8.0);
  const std::string where = part && !part->region.empty() ? ", " + part->region : "";
  std::string html = fmt::format(
      "<figure class=\"table\"><figcaption><strong>At a glance</strong> Each mode against {}, at the "
      "smallest error, the longest time and the most samples that both have{}. Ratios with their 95 % intervals; in "
      "the "
      "bars right is better.</figcaption><table class=\"glance\"><thead><tr><th scope=\"col\">mode<th scope=\"col\">at "
      "equal<th scope=\"col\">compared"
      "<th scope=\"col\">ratio<th scope=\"col\">95 % interval<th scope=\"col\" class=\"scale\">worse ← 1 → better"
      "<th scope=\"col\">verdict<tbody>\n",
      escaped(data.baseline()), escaped(where));
  std::string last;
  for (const pb::CompareRatio* ratio : shown) {
    const VerdictLook look = look_of(ratio->verdict());
    const std::string verdict = fmt::format("<td class={}>{} {}", look.word[0], look.sign, look.word);
    const std::string name = name_of(ratio->kind()).title;
    const std::string kind =
        ratio->kind() == pb::CompareRatio::KIND_SPEED ? "samples" : name.substr(name.find(' ') + 1);
    html += fmt::format("<tr{}><th scope=\"row\">{}<td>{}<td>{}", ratio->mode() == last ? "" : " class=\"first\"",
                        escaped(ratio->mode()), kind, escaped(at_text(*ratio, measure)));
    last = ratio->mode();
    if (!known_ratio(*ratio)) {
      html += "<td>not known<td>–<td>–" + verdict + "\n";
      continue;
    }
    html += fmt::format("<td class=\"ratio\">{}&#8239;×<td class=\"ratio\">{}<td>{}{}\n", number(ratio->ratio().mean()),
                        interval_or_note(data, *ratio), interval_bar(*ratio, octaves), verdict);
  }
  return html + "</table>" + notes(few, nothing) + "</figure>\n";
}

}  // namespace helio::report
