#include "renderer/comparison/mode_sentences.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "renderer/comparison/wording.h"

namespace helio {
namespace {

constexpr std::size_t kMostUndecidedByName = 3;
// Relative difference of a preview's time from that of its ratio: of means over other seeds, or of two preview modes.
constexpr double kSameTime = 0.06;

using Clauses = std::vector<std::string>;

// The latest ratios of one mode to the baseline.
struct Latest {
  const ComparedRatio *error, *time, *samples, *speed;  // null where there is none

  Latest(const Findings& findings, std::size_t mode, const ValueKey& key)
      : error(findings.latest_ratio(RatioKind::equal_error, mode, key)),
        time(findings.latest_ratio(RatioKind::equal_time, mode, key)),
        samples(findings.latest_ratio(RatioKind::equal_samples, mode, key)),
        speed(findings.latest_ratio(RatioKind::speed, mode, {})) {}

  bool nothing_decided() const {
    for (const ComparedRatio* ratio : {error, time, samples}) {
      if (ratio && ratio->verdict != Verdict::undecided) return false;
    }
    return true;
  }
};

std::string equal_error(const ComparedRatio& ratio) {
  const std::string target = " to the " + measure_text({ratio.measure, ratio.region}) + " " + number_text(ratio.at);
  const Interval& r = ratio.ratio;
  switch (ratio.verdict) {
    case Verdict::better:
      return ratio.mode + " is faster than " + ratio.baseline + target + ": " + number_text(r.mean) +
             " times as fast (" + interval_text(r) + ")";
    case Verdict::worse: {
      const Interval longer{1 / r.mean, 1 / r.high, 1 / r.low, true};
      return ratio.mode + " is slower than " + ratio.baseline + target + ": it takes " + number_text(longer.mean) +
             " times as long (" + interval_text(longer) + ")";
    }
    case Verdict::undecided:
      break;
  }
  return "which of " + ratio.mode + " and " + ratio.baseline + " is faster" + target + " is undecided" +
         undecided_reason(ratio) + ": " + ratio.baseline + "'s time is " + times_text(r.mean) + " that of " +
         ratio.mode + " (" + interval_text(r) + ")";
}

std::string with_verdict(const std::string& text, const ComparedRatio& ratio) {
  return ratio.equal() ? text : text + ": " + verdict_text(ratio);
}

// At equal time or samples.
std::string equal_budget(const ComparedRatio& ratio, const std::string& when) {
  const std::string error = when + " " + ratio.mode + "'s " + measure_text({ratio.measure, ratio.region}) + " is ";
  if (ratio.equal()) return error + "that of " + ratio.baseline + " in every seed";
  return error + times_text(ratio.ratio.mean) + " that of " + ratio.baseline + " (" + interval_text(ratio.ratio) + ")";
}

std::string seconds_text(double seconds) {
  return number_text(seconds) + " s";
}

std::string speed(const Findings& findings, const ComparedRatio& ratio) {
  const std::string size = number_text(ratio.ratio.mean);
  return budget_text(findings.script, ratio.at) + (ratio.at == 1 ? " takes " : " take ") + ratio.mode + " " +
         (ratio.ratio.mean < 1 ? size + " of the time of " + ratio.baseline
                               : size + " times as long as " + ratio.baseline) +
         " (" + interval_text(ratio.ratio) + ")" +
         (ratio.verdict == Verdict::undecided ? ": " + verdict_text(ratio) : "");
}

enum class Told { better, worse, equal, undecided };

Told told_of(const ComparedRatio& ratio) {
  if (ratio.equal()) return Told::equal;
  switch (ratio.verdict) {
    case Verdict::better:
      return Told::better;
    case Verdict::worse:
      return Told::worse;
    case Verdict::undecided:
      break;
  }
  return Told::undecided;
}

std::string told_text(Told told) {
  switch (told) {
    case Told::better:
      return "better";
    case Told::worse:
      return "worse";
    case Told::equal:
      return "equal";
    case Told::undecided:
      break;
  }
  return "undecided";
}

using Measures = std::map<Told, std::vector<ValueKey>>;

// All measures but the main one; each at the latest point of that kind.
Measures other_measures(const Findings& findings, std::size_t mode, const ValueKey& main, RatioKind kind) {
  Measures measures;
  for (const ValueKey& key : findings.seeds.keys()) {
    if (key == main || !is_error(key.measure)) continue;
    if (const ComparedRatio* ratio = findings.latest_ratio(kind, mode, key)) measures[told_of(*ratio)].push_back(key);
  }
  return measures;
}

std::string others_sentence(const Findings& findings, std::size_t mode, RatioKind kind, const Measures& measures) {
  Clauses parts;
  for (const auto& [told, keys] : measures) {
    const bool counted = told == Told::undecided && keys.size() > kMostUndecidedByName;
    parts.push_back(told_text(told) + " in " +
                    (counted ? "the " + std::to_string(keys.size()) + " others" : measures_text(keys)));
  }
  if (parts.empty()) return {};
  return (kind == RatioKind::equal_time ? "In the same time " : "With the same samples ") +
         findings.script.modes[mode] + " is, against " + findings.baseline() + ", " + sentence_of(parts);
}

std::string no_common_point(const Findings& findings, std::size_t mode, const ValueKey& key, const Latest& latest) {
  if (findings.budgets() < 2 || (latest.error && latest.time)) return {};
  const std::string modes = findings.script.modes[mode] + " and " + findings.baseline(),
                    curves = ": their curves of the " + measure_text(key) + " have ", end = " in common";
  if (!latest.error && !latest.time)
    return modes + " are compared neither at equal error nor at equal time" + curves + "no error and no time" + end;
  if (!latest.error) return modes + " are not compared at equal error" + curves + "no error" + end;
  return modes + " are not compared at equal time" + curves + "no time" + end;
}

std::string all_views_but_one(const Findings& findings) {
  return findings.script.views == 2 ? "in view 2" : "over views 2 to " + std::to_string(findings.script.views);
}

std::string against_previews(const Findings& findings, std::size_t mode, const ValueKey& key) {
  const std::string& name = findings.script.modes[mode];
  const ComparedRatio* ratio = findings.latest_ratio(RatioKind::equal_time, mode, key);
  if (!ratio) {
    return name + " is not compared with the previews of " + findings.baseline() +
           ": they have no time at which both have a positive " + measure_text(key) + ".";
  }
  return "In " + seconds_text(ratio->at) + " " + name + "'s " + measure_text(key) + " is " +
         times_text(ratio->ratio.mean) + " that of the previews of " + findings.baseline() + ", " +
         all_views_but_one(findings) + " (" + interval_text(ratio->ratio) + "): " + verdict_text(*ratio) + ".";
}

// At the time of the previews: the one that comes closest to it.
const ComparedRatio* ratio_at(const Findings& findings, std::size_t mode, const ValueKey& key, double seconds) {
  const ComparedRatio* found = nullptr;
  for (const ComparedRatio& ratio : findings.table.ratios) {
    if (ratio.kind != RatioKind::equal_time || ratio.mode != findings.script.modes[mode]) continue;
    if (ValueKey{ratio.measure, ratio.region} != key || std::abs(ratio.at - seconds) > kSameTime * seconds) continue;
    if (!found || std::abs(ratio.at - seconds) < std::abs(found->at - seconds)) found = &ratio;
  }
  return found;
}

// Of errors; the reason of the first ratio that has one.
std::string reason_of(const Latest& latest) {
  for (const ComparedRatio* ratio : {latest.time, latest.samples, latest.error}) {
    if (ratio && ratio->few_pixels_decide) return undecided_reason(*ratio);
  }
  return {};
}

std::string undecided_sentence(const Findings& findings, std::size_t mode, const ValueKey& key, const Latest& latest,
                               bool others_too) {
  const std::string &name = findings.script.modes[mode], &baseline = findings.baseline();
  Clauses clauses;
  if (!latest.error && !latest.time && !latest.samples) {
    clauses.push_back(name + " and " + baseline +
                      " are not compared: there is no budget, time or error at which both have a positive " +
                      measure_text(key));
    if (latest.speed) clauses.push_back(speed(findings, *latest.speed));
    return sentence_of(clauses);
  }
  if (latest.time) clauses.push_back(equal_budget(*latest.time, "in " + seconds_text(latest.time->at)));
  if (latest.samples) clauses.push_back(equal_budget(*latest.samples, findings.when(latest.samples->at)));
  if (latest.speed) clauses.push_back(speed(findings, *latest.speed));
  const std::string nothing_common = no_common_point(findings, mode, key, latest);
  if (!latest.error && !latest.time && !nothing_common.empty())
    clauses.push_back("their curves have no error and no time in common");
  if (latest.samples && latest.samples->equal()) return capital(sentence_of(clauses));
  return "Which of " + name + " and " + baseline + " has the lower " + measure_text(key) + " is undecided" +
         (others_too ? ", as are all other measures" : "") + reason_of(latest) +
         (clauses.empty() ? std::string(".") : ": " + sentence_of(clauses));
}

}  // namespace

std::vector<std::string> mode_sentences(const Findings& findings, std::size_t mode, const ValueKey& key) {
  if (findings.seeds.is_preview(0)) return {against_previews(findings, mode, key)};
  const Latest latest(findings, mode, key);
  const RatioKind kind = latest.time ? RatioKind::equal_time : RatioKind::equal_samples;
  const auto others = other_measures(findings, mode, key, kind);
  const bool others_decided = others.count(Told::better) + others.count(Told::worse) + others.count(Told::equal) > 0;

  std::vector<std::string> lines;
  if (latest.nothing_decided()) {
    lines.push_back(undecided_sentence(findings, mode, key, latest, !others.empty() && !others_decided));
    if (others_decided) lines.push_back(others_sentence(findings, mode, kind, others));
    return lines;
  }
  Clauses in_time, in_samples;
  if (latest.error) in_time.push_back(equal_error(*latest.error));
  if (latest.time) {
    const std::string when = "in " + seconds_text(latest.time->at);
    in_time.push_back(with_verdict(equal_budget(*latest.time, when), *latest.time));
  }
  if (const std::string missing = no_common_point(findings, mode, key, latest); !missing.empty())
    in_time.push_back(missing);
  if (latest.samples) {
    const std::string when = findings.when(latest.samples->at);
    in_samples.push_back(with_verdict(equal_budget(*latest.samples, when), *latest.samples));
  }
  if (latest.speed) in_samples.push_back(speed(findings, *latest.speed));
  // A decided ratio of time starts with the mode's name.
  const bool starts_with_name = latest.error ? latest.error->verdict != Verdict::undecided : !latest.time;
  lines.push_back(starts_with_name ? sentence_of(in_time) : capital(sentence_of(in_time)));
  lines.push_back(capital(sentence_of(in_samples)));
  lines.push_back(others_sentence(findings, mode, kind, others));
  std::erase(lines, "");
  return lines;
}

std::string preview_sentence(const Findings& findings, std::size_t mode, const ValueKey& key, std::uint32_t budget) {
  const ComparedPoint* point = findings.point(mode, budget);
  if (!point) return {};
  const std::string &name = findings.script.modes[mode], &baseline = findings.baseline();
  std::string text = "A preview of " + name + " takes " + seconds_text(point->seconds.mean) + " on average";
  const ComparedPoint::Value* error = Findings::value(point, key);
  if (error) {
    text += " and has the " + measure_text(key) + " " + number_text(error->value.mean) + " (" +
            interval_text(error->value) + ")";
  }
  text += ", " + all_views_but_one(findings);
  if (findings.budgets() > 1)
    text += ", after a first view of " + budget_text(findings.script, findings.script.budgets[budget]);
  if (mode == 0 || !error || !(error->value.mean > 0)) return text + ".";
  const ComparedRatio* ratio = ratio_at(findings, mode, key, point->seconds.mean);
  if (!ratio) {
    return text + "; " +
           (findings.seeds.is_preview(0)
                ? "those of " + baseline + " do not take as long, and are not compared with it."
                : baseline + "'s curve does not enclose that time.");
  }
  return text + "; after the same time " + baseline + " has " + number_text(error->value.mean / ratio->ratio.mean) +
         ", and " + name + "'s is " + times_text(ratio->ratio.mean) + " that (" + interval_text(ratio->ratio) +
         "): " + verdict_text(*ratio) + ".";
}

}  // namespace helio
