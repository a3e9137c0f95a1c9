#include "renderer/comparison/sentences.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>

#include "renderer/comparison/ratios.h"
#include "renderer/comparison/wording.h"

namespace helio {
namespace {

// So many ratios with intervals that some of them miss by chance.
constexpr std::size_t kManyRatios = 20;

using Lines = std::vector<std::string>;

// What the sentences are made from.
struct Told {
  const ComparisonScript& script;
  const SeedTable& seeds;
  const ComparisonTable& table;

  // Of a path, over all views.
  const ComparedPoint* point(const std::string& mode, std::uint32_t budget) const {
    const std::optional<std::uint32_t> view = script.views > 1 ? std::nullopt : std::optional(0u);
    for (const ComparedPoint& point : table.points) {
      if (point.mode == mode && point.budget == budget && point.view == view) return &point;
    }
    return nullptr;
  }

  static const ComparedPoint::Value* value(const ComparedPoint* point, const ValueKey& key) {
    if (!point) return nullptr;
    for (const ComparedPoint::Value& value : point->values) {
      if (value.measure == key.measure && value.region == key.region) return &value;
    }
    return nullptr;
  }

  // The last at which some mode has seeds.
  std::optional<std::uint32_t> last_budget() const {
    std::optional<std::uint32_t> last;
    for (const ComparedPoint& point : table.points) last = std::max(last.value_or(0), point.budget);
    return last;
  }

  // The one that most is told of: relmse, else mse, else the first error of the whole picture.
  std::optional<ValueKey> main_key() const {
    std::optional<ValueKey> first;
    for (const Measure measure : {Measure::relmse, Measure::mse}) {
      const ValueKey key{measure, {}};
      if (std::find(seeds.keys().begin(), seeds.keys().end(), key) != seeds.keys().end()) return key;
    }
    for (const ValueKey& key : seeds.keys()) {
      if (is_error(key.measure) && key.region.empty()) return key;
    }
    return std::nullopt;
  }

  // "after 64 samples per pixel", "in 2 s".
  std::string when(double at) const {
    return (script.budgets_are_seconds ? "in " : "after ") + budget_text(script, at);
  }
};

std::string capital(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = char(text[0] - 'a' + 'A');
  return text;
}

std::string in_words(Verdict verdict) {
  switch (verdict) {
    case Verdict::better:
      return "better";
    case Verdict::worse:
      return "worse";
    case Verdict::undecided:
      return "undecided";
  }
  return "undecided";
}

const ComparedRatio* find_ratio(const std::vector<ComparedRatio>& ratios, RatioKind kind, const std::string& mode,
                                const ValueKey& key, bool largest) {
  const ComparedRatio* found = nullptr;
  for (const ComparedRatio& ratio : ratios) {
    if (ratio.kind != kind || ratio.mode != mode) continue;
    if (kind != RatioKind::speed && ValueKey{ratio.measure, ratio.region} != key) continue;
    if (!found || (largest ? ratio.at > found->at : ratio.at < found->at)) found = &ratio;
  }
  return found;
}

// "0.42 of", "1.8 times".
std::string times(double ratio) {
  return number_text(ratio) + (ratio < 1 ? " of" : " times");
}

// Which mode has the lowest error at the last budget, and whether that is certain.
void tell_best(const Told& told, const ValueKey& key, std::uint32_t budget, Lines& lines) {
  struct Candidate {
    std::size_t mode;
    Interval error;
  };
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < told.script.modes.size(); ++i) {
    const ComparedPoint::Value* value = Told::value(told.point(told.script.modes[i], budget), key);
    if (value && value->value.mean > 0) candidates.push_back({i, value->value});
  }
  if (candidates.size() < 2) return;
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.error.mean < b.error.mean; });
  const std::string &best = told.script.modes[candidates[0].mode], &next = told.script.modes[candidates[1].mode];
  const std::string measure = measure_text(key.measure, key.region);
  const double at = told.script.budgets[budget];
  std::string text = capital(told.when(at)) + " " + best + " has the lowest " + measure + " of " +
                     std::to_string(candidates.size()) + " modes: " + number_text(candidates[0].error.mean) + " (" +
                     interval_text(candidates[0].error) + ").";
  const std::vector<ComparedRatio> ratios =
      compare_modes(told.script, told.seeds, candidates[0].mode, candidates[1].mode);
  const RatioKind kind = told.script.budgets_are_seconds ? RatioKind::equal_time : RatioKind::equal_samples;
  const ComparedRatio* ratio = find_ratio(ratios, kind, best, key, true);
  if (ratio && ratio->at == at) {
    const std::string size = times(ratio->ratio.mean) + " that of " + next + " (" + interval_text(ratio->ratio) + ")";
    text += ratio->verdict == Verdict::better ? " The next is " + next + ": " + best + " has " + size + "."
                                              : " That it is lower than the next is undecided: it is " + size + ".";
  }
  lines.push_back(std::move(text));
}

// At an error that both reach, as late as there is one.
void tell_equal_error(const Told& told, const std::string& mode, const ValueKey& key, Lines& lines) {
  const std::string &baseline = told.script.modes[0], measure = measure_text(key.measure, key.region);
  const ComparedRatio* ratio = find_ratio(told.table.ratios, RatioKind::equal_error, mode, key, false);
  if (!ratio) {
    if (told.script.budgets.size() < 2) return;
    lines.push_back(
        "No time to an equal " + measure + " is told of " + mode + " and " + baseline +
        ": their curves have no error in common that both are known to reach, and nothing is extrapolated.");
    return;
  }
  const std::string error = "the " + measure + " " + number_text(ratio->at);
  const Interval& r = ratio->ratio;
  switch (ratio->verdict) {
    case Verdict::better:
      lines.push_back("To " + error + ", " + mode + " is faster than " + baseline + ": " + number_text(r.mean) +
                      " times as fast (" + interval_text(r) + ").");
      break;
    case Verdict::worse: {
      const Interval longer{1 / r.mean, 1 / r.high, 1 / r.low, true};
      lines.push_back("To " + error + ", " + mode + " is slower than " + baseline + ": it takes " +
                      number_text(longer.mean) + " times as long (" + interval_text(longer) + ").");
      break;
    }
    case Verdict::undecided:
      lines.push_back("Which of " + mode + " and " + baseline + " is faster to " + error + " is undecided: " +
                      baseline + "'s time is " + times(r.mean) + " that of " + mode + " (" + interval_text(r) + ").");
      break;
  }
}

void tell_equal(const Told& told, const ComparedRatio* ratio, const std::string& when, Lines& lines) {
  if (!ratio) return;
  lines.push_back(capital(when) + " the " + measure_text(ratio->measure, ratio->region) + " of " + ratio->mode +
                  " is " + times(ratio->ratio.mean) + " that of " + told.script.modes[0] + " (" +
                  interval_text(ratio->ratio) + "): " + in_words(ratio->verdict) + ".");
}

void tell_speed(const Told& told, const std::string& mode, Lines& lines) {
  const ComparedRatio* ratio = find_ratio(told.table.ratios, RatioKind::speed, mode, {}, true);
  if (!ratio) return;
  const std::string work = budget_text(told.script, ratio->at) + (ratio->at == 1 ? " takes " : " take ");
  const std::string &baseline = told.script.modes[0], size = number_text(ratio->ratio.mean);
  lines.push_back(
      work + mode + " " +
      (ratio->ratio.mean < 1 ? size + " of the time of " + baseline : size + " times as long as " + baseline) + " (" +
      interval_text(ratio->ratio) + ")" + (ratio->verdict == Verdict::undecided ? ": undecided." : "."));
}

// All measures but the main one, each at the latest point of that kind.
void tell_other_measures(const Told& told, const std::string& mode, const ValueKey& main, RatioKind kind,
                         Lines& lines) {
  std::map<Verdict, Lines> measures;
  for (const ValueKey& key : told.seeds.keys()) {
    if (key == main || !is_error(key.measure)) continue;
    if (const ComparedRatio* ratio = find_ratio(told.table.ratios, kind, mode, key, true))
      measures[ratio->verdict].push_back(measure_text(key.measure, key.region));
  }
  if (measures.empty()) return;
  Lines parts;
  for (const auto& [verdict, names] : measures) parts.push_back(in_words(verdict) + " in " + list_text(names));
  std::string text = std::string(kind == RatioKind::equal_time ? "In the same time " : "With the same samples ") +
                     mode + " is, against " + told.script.modes[0] + ", ";
  for (std::size_t i = 0; i < parts.size(); ++i) text += (i > 0 ? "; " : "") + parts[i];
  lines.push_back(text + ".");
}

void tell_mode(const Told& told, const std::string& mode, const ValueKey& key, Lines& lines) {
  tell_equal_error(told, mode, key, lines);
  const ComparedRatio* in_time = find_ratio(told.table.ratios, RatioKind::equal_time, mode, key, true);
  if (in_time) tell_equal(told, in_time, "in " + number_text(in_time->at) + " s", lines);
  if (!in_time && told.script.budgets.size() > 1) {
    lines.push_back("The " + measure_text(key.measure, key.region) + " of " + mode + " and " + told.script.modes[0] +
                    " is not compared at equal time: they have no time in common.");
  }
  const ComparedRatio* in_samples = find_ratio(told.table.ratios, RatioKind::equal_samples, mode, key, true);
  if (in_samples) tell_equal(told, in_samples, told.when(in_samples->at), lines);
  tell_speed(told, mode, lines);
  tell_other_measures(told, mode, key, in_time ? RatioKind::equal_time : RatioKind::equal_samples, lines);
}

// A mean that differs from the reference's by more than the seeds do.
void tell_bias(const Told& told, std::uint32_t budget, Lines& lines) {
  for (const std::string& mode : told.script.modes) {
    const ComparedPoint::Value* bias = Told::value(told.point(mode, budget), {Measure::bias, {}});
    if (!bias || !bias->value.known || (bias->value.low <= 0 && bias->value.high >= 0)) continue;
    lines.push_back(capital(told.when(told.script.budgets[budget])) + " the mean of " + mode +
                    "'s pictures differs from that of the reference by " + number_text(100 * bias->value.mean) +
                    " % (95 %: " + number_text(100 * bias->value.low) + " to " + number_text(100 * bias->value.high) +
                    "), more than the seeds explain; the noise of the reference is not counted.");
  }
}

std::string at_budgets(const Told& told, const std::vector<std::uint32_t>& budgets) {
  Lines items;
  for (std::size_t i = 0; i < budgets.size(); ++i) {
    const double at = told.script.budgets[budgets[i]];
    items.push_back(i + 1 == budgets.size() ? budget_text(told.script, at) : number_text(at));
  }
  return list_text(items);
}

// Measures of one mode that rare, large errors decide, those of the same budgets in one sentence.
void tell_few_pixels(const Told& told, const std::string& mode, Lines& lines) {
  struct Finding {
    std::vector<std::uint32_t> budgets;
    double share = 0;  // of the last of these budgets, where pixels say it; else 0
    bool operator<(const Finding& other) const {
      return std::pair(budgets, share) < std::pair(other.budgets, other.share);
    }
  };
  std::map<Finding, Lines> findings;
  for (const ValueKey& key : told.seeds.keys()) {
    Finding finding;
    for (std::uint32_t budget = 0; budget < told.script.budgets.size(); ++budget) {
      const ComparedPoint* point = told.point(mode, budget);
      const ComparedPoint::Value* value = Told::value(point, key);
      if (!value || !value->few_pixels_decide) continue;
      finding.budgets.push_back(budget);
      const ComparedPoint::Value* share = Told::value(point, {Measure::outlier_share, key.region});
      const bool squared = key.measure == Measure::mse || key.measure == Measure::relmse;
      finding.share = share && squared ? share->value.mean : 0;
    }
    if (!finding.budgets.empty()) findings[finding].push_back(measure_text(key.measure, key.region));
  }
  for (const auto& [finding, measures] : findings) {
    std::string text = "A few pixels decide the " + list_text(measures) + " of " + mode + " at " +
                       at_budgets(told, finding.budgets) + ": ";
    text += finding.share > 0
                ? "on average 0.1 % of the pixels have " + number_text(100 * finding.share) +
                      " % of a picture's squared relative error" + (finding.budgets.size() > 1 ? " at the last." : ".")
                : "its seeds differ as they do where rare, large errors decide.";
    lines.push_back(text + " Other seeds may come to quite another mean.");
  }
}

void tell_unresolved(const Told& told, const std::string& mode, Lines& lines) {
  for (const ValueKey& key : told.seeds.keys()) {
    if (key.measure != Measure::mse && key.measure != Measure::relmse) continue;
    std::vector<std::uint32_t> budgets;
    for (std::uint32_t budget = 0; budget < told.script.budgets.size(); ++budget) {
      const ComparedPoint::Value* value = Told::value(told.point(mode, budget), key);
      if (!value) continue;
      if (value->value.mean < 0 || (value->value.known && value->value.low < 0)) budgets.push_back(budget);
    }
    if (budgets.empty()) continue;
    lines.push_back("The reference does not resolve the " + measure_text(key.measure, key.region) + " of " + mode +
                    " at " + at_budgets(told, budgets) +
                    ": less the reference's own noise it cannot be told from 0. Means at or below 0 are in no ratio; a"
                    " reference of more samples would resolve them.");
  }
}

void tell_disturbed(const Told& told, Lines& lines) {
  std::uint32_t disturbed = 0;
  Lines modes;
  for (const std::string& mode : told.script.modes) {
    std::uint32_t of_mode = 0;
    for (const ComparedPoint& point : told.table.points) {
      if (point.mode == mode && point.view) of_mode += point.disturbed;
    }
    if (of_mode > 0) modes.push_back(std::to_string(of_mode) + " of " + mode);
    disturbed += of_mode;
  }
  if (disturbed == 0) return;
  lines.push_back(std::to_string(disturbed) + (disturbed == 1 ? " picture was" : " pictures were") +
                  " disturbed by other programs: " + list_text(modes) +
                  ". Their times are not those of an idle machine, nor are the comparisons of time that they are in.");
}

void tell_few_seeds(const Told& told, Lines& lines) {
  std::map<std::uint32_t, Lines> modes;  // by the fewest seeds of any budget
  for (const std::string& mode : told.script.modes) {
    std::optional<std::uint32_t> fewest;
    for (std::uint32_t budget = 0; budget < told.script.budgets.size(); ++budget) {
      const ComparedPoint* point = told.point(mode, budget);
      if (point) fewest = std::min(fewest.value_or(point->seeds), point->seeds);
    }
    if (!fewest) {
      lines.push_back("There is no complete seed of " + mode + ".");
    } else if (*fewest < std::uint32_t(kLeastSeeds)) {
      modes[*fewest].push_back(mode);
    }
  }
  for (const auto& [seeds, names] : modes) {
    lines.push_back("Of " + list_text(names) + " there " + (seeds == 1 ? "is 1 seed" : "are only ") +
                    (seeds == 1 ? "" : std::to_string(seeds) + " seeds") + " at some budgets: below " +
                    std::to_string(kLeastSeeds) + " seeds there are no intervals, and nothing is decided.");
  }
}

void tell_chance(const Told& told, Lines& lines) {
  const auto known = std::size_t(std::count_if(told.table.ratios.begin(), told.table.ratios.end(),
                                               [](const ComparedRatio& ratio) { return ratio.ratio.known; }));
  if (known < kManyRatios) return;
  lines.push_back("Each interval is one of 95 % by itself: of the " + std::to_string(known) +
                  " ratios about one in 20 misses by chance.");
}

}  // namespace

std::vector<std::string> comparison_sentences(const ComparisonScript& script, const SeedTable& seeds,
                                              const ComparisonTable& table) {
  const Told told{script, seeds, table};
  Lines lines;
  const std::optional<std::uint32_t> last = told.last_budget();
  if (!last) return {"There are no pictures to compare."};
  if (const std::optional<ValueKey> key = told.main_key()) {
    tell_best(told, *key, *last, lines);
    for (std::size_t mode = 1; mode < script.modes.size(); ++mode) {
      const auto of_mode = [&](const ComparedPoint& point) { return point.mode == script.modes[mode]; };
      if (std::any_of(table.points.begin(), table.points.end(), of_mode))
        tell_mode(told, script.modes[mode], *key, lines);
    }
  }
  tell_bias(told, *last, lines);
  for (const std::string& mode : script.modes) {
    tell_few_pixels(told, mode, lines);
    tell_unresolved(told, mode, lines);
  }
  tell_disturbed(told, lines);
  tell_few_seeds(told, lines);
  tell_chance(told, lines);
  return lines;
}

}  // namespace helio
