#include "renderer/comparison/limit_sentences.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <set>

#include "renderer/comparison/wording.h"

namespace helio {
namespace {

constexpr std::size_t kManyRatios = 20;        // with intervals: some of them miss by chance
constexpr std::size_t kMostFewPixelLines = 8;  // with more modes, all are in one
constexpr std::size_t kMostViewGroups = 3;

using Lines = std::vector<std::string>;

// A mean that differs from the reference's by more than the seeds do.
std::string bias_sentence(const Findings& findings, std::uint32_t last) {
  Lines modes;
  bool counted = true;  // the noise of the reference
  const ValueKey key{Measure::bias, {}};
  const auto& keys = findings.seeds.keys();
  const auto index = std::size_t(std::find(keys.begin(), keys.end(), key) - keys.begin());
  for (std::size_t mode = 0; mode < findings.script.modes.size(); ++mode) {
    const ComparedPoint::Value* bias = Findings::value(findings.point(mode, last), key);
    if (!bias || !bias->value.known || (bias->value.low <= 0 && bias->value.high >= 0)) continue;
    counted &= findings.seeds.reference_error(index, findings.seeds.views_of(mode)) > 0;
    modes.push_back(findings.script.modes[mode] + " by " + number_text(100 * bias->value.mean) + " % (95 %: " +
                    number_text(100 * bias->value.low) + " to " + number_text(100 * bias->value.high) + ")");
  }
  if (modes.empty()) return {};
  return "At the last budget the mean of the pictures differs from that of the reference by more than the seeds" +
         std::string(counted ? " and the noise of the reference explain: " : " explain: ") + list_text(modes) +
         (counted ? "." : "; the noise of the reference is not known, and not counted.");
}

// Values of one mode of which something holds.
struct Affected {
  std::vector<ValueKey> keys;
  std::set<std::uint32_t> budgets;  // at which it holds of one of them
  bool everywhere = true;           // it holds of all of them at all of these

  bool empty() const { return keys.empty(); }
};

Affected find_affected(const Findings& findings, std::size_t mode,
                       const std::function<bool(const ComparedPoint::Value&)>& holds) {
  Affected affected;
  for (const ValueKey& key : findings.seeds.keys()) {
    std::set<std::uint32_t> budgets;
    for (std::uint32_t budget = 0; budget < findings.budgets(); ++budget) {
      const ComparedPoint::Value* value = Findings::value(findings.point(mode, budget), key);
      if (value && holds(*value)) budgets.insert(budget);
    }
    if (budgets.empty()) continue;
    affected.everywhere &= affected.empty() || budgets == affected.budgets;
    affected.keys.push_back(key);
    affected.budgets.insert(budgets.begin(), budgets.end());
  }
  return affected;
}

// "pt's MSE and DSSIM at 1 and 2 samples per pixel", "errors of pt at 1 and 2 samples per pixel (MSE, and DSSIM)".
std::string affected_text(const Findings& findings, std::size_t mode, const Affected& affected) {
  Lines budgets;
  for (const std::uint32_t budget : affected.budgets) {
    const double at = findings.script.budgets[budget];
    const bool last = budgets.size() + 1 == affected.budgets.size();
    budgets.push_back(last ? budget_text(findings.script, at) : number_text(at));
  }
  const std::string& name = findings.script.modes[mode];
  const bool previews = findings.seeds.is_preview(mode);
  const std::string where = (previews ? " after first views of " : " at ") + list_text(budgets),
                    whose = name + (previews ? "'s previews" : "");
  return affected.everywhere ? (previews ? "the " + measures_text(affected.keys) + " of " + whose
                                         : name + "'s " + measures_text(affected.keys)) +
                                   where
                             : "errors of " + whose + where + " (" + measures_text(affected.keys) + ")";
}

// The outlier share of the whole picture, where pixels say it; else 0.
double outlier_share(const Findings& findings, std::size_t mode, const Affected& affected) {
  const bool squared = std::any_of(affected.keys.begin(), affected.keys.end(), [](const ValueKey& key) {
    return key.region.empty() && (key.measure == Measure::mse || key.measure == Measure::relmse);
  });
  const ComparedPoint* point = findings.point(mode, *affected.budgets.rbegin());
  const ComparedPoint::Value* share = Findings::value(point, {Measure::outlier_share, {}});
  return squared && share ? share->value.mean : 0;
}

// Values that rare, large errors decide.
Lines few_pixel_sentences(const Findings& findings) {
  Lines lines, modes;
  for (std::size_t mode = 0; mode < findings.script.modes.size(); ++mode) {
    const Affected affected =
        find_affected(findings, mode, [](const ComparedPoint::Value& value) { return value.few_pixels_decide; });
    if (affected.empty()) continue;
    modes.push_back(findings.script.modes[mode]);
    const double share = outlier_share(findings, mode, affected);
    lines.push_back("A few pixels decide " + affected_text(findings, mode, affected) + ": " +
                    (share > 0 ? "on average 0.1 % of the pixels have " + number_text(100 * share) +
                                     " % of a picture's squared relative error" +
                                     (affected.budgets.size() > 1 ? " at the last" : "")
                               : "its seeds differ as they do where rare, large errors decide") +
                    ", and other seeds may come to quite another mean.");
  }
  if (lines.size() <= kMostFewPixelLines) return lines;
  return {"A few pixels decide errors of " + list_text(modes, modes.size()) +
          ", and other seeds may come to quite another mean; the points of the table say of each which."};
}

std::string unresolved_sentence(const Findings& findings) {
  const auto unresolved = [](const ComparedPoint::Value& value) {
    return (value.measure == Measure::mse || value.measure == Measure::relmse) &&
           (value.value.mean < 0 || (value.value.known && value.value.low < 0));
  };
  Lines modes;
  for (std::size_t mode = 0; mode < findings.script.modes.size(); ++mode) {
    const Affected affected = find_affected(findings, mode, unresolved);
    if (!affected.empty()) modes.push_back(affected_text(findings, mode, affected));
  }
  if (modes.empty()) return {};
  std::string text = sentence_of(modes);
  text.pop_back();
  return "The reference does not resolve " + text +
         ": less the reference's own noise they cannot be told from 0, and means at or below 0 are in no ratio.";
}

// Views of a path that a mean leaves out, because the value is defined in none of their pictures.
std::string undefined_views_sentence(const Findings& findings) {
  const std::uint32_t views = findings.script.views;
  if (views < 2) return {};
  std::map<std::vector<std::string>, std::vector<ValueKey>> groups;  // by the views that are left out
  bool regions = false;
  for (std::size_t i = 0; i < findings.seeds.keys().size(); ++i) {
    const ValueKey& key = findings.seeds.keys()[i];
    if (!is_error(key.measure) && key.measure != Measure::bias) continue;
    std::vector<std::string> left_out;
    for (std::uint32_t view = key.measure == Measure::flicker ? 1 : 0; view < views; ++view) {
      if (!findings.seeds.is_defined(i, view)) left_out.push_back(std::to_string(view + 1));
    }
    if (left_out.empty()) continue;
    if (key.region.empty()) groups[left_out].push_back(key);
    regions |= !key.region.empty();
  }
  Lines clauses;
  for (const auto& [left_out, keys] : groups) {
    if (clauses.size() == kMostViewGroups) break;
    clauses.push_back("means of the " + measures_text(keys) + " are over " + std::to_string(views - left_out.size()) +
                      " of the " + std::to_string(views) + " views, without " +
                      (left_out.size() == 1 ? "view " : "views ") + list_text(left_out));
  }
  if (regions) clauses.push_back("some means of regions and of the dark half are over fewer views, too");
  if (clauses.empty()) return {};
  std::string text = sentence_of(clauses);
  text.pop_back();
  return "Where a value is not defined, as with a black reference, its view is left out: " + text + ".";
}

std::string disturbed_sentence(const Findings& findings) {
  std::uint32_t disturbed = 0;
  Lines modes;
  for (const std::string& mode : findings.script.modes) {
    std::uint32_t of_mode = 0;
    for (const ComparedPoint& point : findings.table.points) {
      if (point.mode == mode && point.view) of_mode += point.disturbed;
    }
    if (of_mode > 0) modes.push_back(std::to_string(of_mode) + " of " + mode);
    disturbed += of_mode;
  }
  if (disturbed == 0) return {};
  return std::to_string(disturbed) + (disturbed == 1 ? " picture was" : " pictures were") +
         " disturbed by other programs: " + list_text(modes) +
         ". Their times are not those of an idle machine, nor are the comparisons of time that they are in.";
}

// Modes that took no turns with the first one.
std::string different_calls_sentence(const Findings& findings) {
  Lines modes;
  for (const ComparedRatio& ratio : findings.table.ratios) {
    if (ratio.different_calls && std::find(modes.begin(), modes.end(), ratio.mode) == modes.end())
      modes.push_back(ratio.mode);
  }
  if (modes.empty()) return {};
  return "Most pictures of " + list_text(modes) + " are not from the calls that rendered those of " +
         findings.baseline() +
         ", with which they took no turns: what else the machine did then is in the times of one and not of the other, "
         "and comparisons of time are undecided.";
}

std::string few_seeds_sentence(const Findings& findings) {
  Lines none, few;
  for (std::size_t mode = 0; mode < findings.script.modes.size(); ++mode) {
    std::optional<std::uint32_t> fewest;
    for (std::uint32_t budget = 0; budget < findings.budgets(); ++budget) {
      const ComparedPoint* point = findings.point(mode, budget);
      if (point) fewest = std::min(fewest.value_or(point->seeds), point->seeds);
    }
    if (!fewest) {
      none.push_back(findings.script.modes[mode]);
    } else if (*fewest < std::uint32_t(kLeastSeeds)) {
      few.push_back(std::to_string(*fewest) + " of " + findings.script.modes[mode]);
    }
  }
  Lines clauses;
  if (!none.empty()) clauses.push_back("there is no complete seed of " + list_text(none));
  if (!few.empty()) {
    clauses.push_back("at some budgets there are too few seeds, " + list_text(few) + ": below " +
                      std::to_string(kLeastSeeds) + " seeds there are no intervals, and nothing is decided");
  }
  return capital(sentence_of(clauses));
}

std::string chance_sentence(const Findings& findings) {
  const auto known = std::size_t(std::count_if(findings.table.ratios.begin(), findings.table.ratios.end(),
                                               [](const ComparedRatio& ratio) { return ratio.ratio.known; }));
  if (known < kManyRatios) return {};
  return "Each interval is one of 95 % by itself: of the " + std::to_string(known) +
         " ratios about one in 20 misses by chance.";
}

}  // namespace

std::vector<std::string> limit_sentences(const Findings& findings, std::uint32_t last) {
  Lines lines = {bias_sentence(findings, last)};
  for (std::string& line : few_pixel_sentences(findings)) lines.push_back(std::move(line));
  lines.push_back(unresolved_sentence(findings));
  lines.push_back(undefined_views_sentence(findings));
  lines.push_back(disturbed_sentence(findings));
  lines.push_back(different_calls_sentence(findings));
  lines.push_back(few_seeds_sentence(findings));
  lines.push_back(chance_sentence(findings));
  std::erase(lines, "");
  return lines;
}

}  // namespace helio
