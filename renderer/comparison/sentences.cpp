#include "renderer/comparison/sentences.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include "renderer/comparison/findings.h"
#include "renderer/comparison/limit_sentences.h"
#include "renderer/comparison/mode_sentences.h"
#include "renderer/comparison/ratios.h"
#include "renderer/comparison/wording.h"

namespace helio {
namespace {

// Which mode that renders to the budgets has the lowest error at the last one, and whether that is certain. Empty with
// fewer than two of them.
std::string best_sentence(const Findings& findings, const ValueKey& key, std::uint32_t last) {
  struct Candidate {
    std::size_t mode;
    Interval error;
  };
  std::vector<Candidate> candidates;
  for (std::size_t mode = 0; mode < findings.script.modes.size(); ++mode) {
    if (findings.seeds.is_preview(mode)) continue;
    const ComparedPoint::Value* value = Findings::value(findings.point(mode, last), key);
    if (value && value->value.mean > 0) candidates.push_back({mode, value->value});
  }
  if (candidates.size() < 2) return {};
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.error.mean < b.error.mean; });
  const double at = findings.script.budgets[last];
  const RatioKind kind = findings.script.budgets_are_seconds ? RatioKind::equal_time : RatioKind::equal_samples;
  const std::string& best = findings.script.modes[candidates[0].mode];
  const auto ratio_to = [&](const Candidate& next) -> std::optional<ComparedRatio> {
    const std::vector<ComparedRatio> ratios =
        compare_modes(findings.script, findings.seeds, candidates[0].mode, next.mode);
    const ComparedRatio* ratio = latest_ratio(ratios, kind, best, key);
    return ratio && ratio->at == at ? std::optional(*ratio) : std::nullopt;
  };
  // Those that are equal to the best one, and the first that is not.
  std::vector<std::string> equal = {best};
  std::optional<ComparedRatio> ratio = ratio_to(candidates[1]);
  std::size_t next = 1;
  while (ratio && ratio->equal()) {
    equal.push_back(findings.script.modes[candidates[next].mode]);
    ratio = ++next < candidates.size() ? ratio_to(candidates[next]) : std::nullopt;
  }
  if (equal.size() > 1) {
    const std::string text = capital(findings.when(at)) + " the " + measure_text(key) + " of " + list_text(equal) +
                             " is the same in every seed: " + number_text(candidates[0].error.mean) + " (" +
                             interval_text(candidates[0].error) + ")";
    return text +
           (next < candidates.size() ? ", the lowest among " + std::to_string(candidates.size()) + " modes." : ".");
  }
  std::string text = capital(findings.when(at)) + " " + best + " has the lowest " + measure_text(key) + " among " +
                     std::to_string(candidates.size()) + " modes: " + number_text(candidates[0].error.mean) + " (" +
                     interval_text(candidates[0].error) + ").";
  if (!ratio) return text;
  const std::string& second = findings.script.modes[candidates[1].mode];
  const std::string size =
      times_text(ratio->ratio.mean) + " that of " + second + " (" + interval_text(ratio->ratio) + ")";
  return text + (ratio->verdict == Verdict::better ? " The next is " + second + ": " + best + " has " + size + "."
                                                   : " That it is lower than the next is undecided" +
                                                         undecided_reason(*ratio) + ": it is " + size + ".");
}

}  // namespace

std::vector<std::string> comparison_sentences(const ComparisonScript& script, const SeedTable& seeds,
                                              const ComparisonTable& table) {
  const Findings findings{script, seeds, table};
  const std::optional<std::uint32_t> last = findings.last_budget();
  if (!last) return {"There are no pictures to compare."};
  std::vector<std::string> lines;
  const auto add = [&](std::vector<std::string> more) {
    for (std::string& line : more) {
      if (!line.empty()) lines.push_back(std::move(line));
    }
  };
  if (const std::optional<ValueKey> key = findings.main_key()) {
    add({best_sentence(findings, *key, *last)});
    for (std::size_t mode = 0; mode < script.modes.size(); ++mode) {
      if (seeds.is_preview(mode)) {
        add({preview_sentence(findings, mode, *key, *last)});
      } else if (mode > 0 && findings.has_points(mode)) {
        add(mode_sentences(findings, mode, *key));
      }
    }
  }
  add(limit_sentences(findings, *last));
  return lines;
}

}  // namespace helio
