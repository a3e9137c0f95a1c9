#include "renderer/comparison/wording.h"

#include <algorithm>
#include <cstdio>

namespace helio {
namespace {

std::string region_text(const std::string& region) {
  if (region.empty()) return "the whole picture";
  return region == kDarkHalf ? "the dark half" : "the region " + region;
}

}  // namespace

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string interval_text(const Interval& interval) {
  if (!interval.known) return "no interval";
  return "95 %: " + number_text(interval.low) + " to " + number_text(interval.high);
}

std::string budget_text(const ComparisonScript& script, double at) {
  if (script.budgets_are_seconds) return number_text(at) + " s";
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", at);
  return std::string(text) + (at == 1 ? " sample per pixel" : " samples per pixel");
}

std::string measure_text(const ValueKey& key) {
  const std::string name = to_string(key.measure);
  return key.region.empty() ? name : name + " in " + region_text(key.region);
}

std::string measures_text(const std::vector<ValueKey>& keys) {
  struct Group {
    std::vector<std::string> regions, measures;
    bool whole_alone() const { return regions.size() == 1 && regions[0].empty(); }
  };
  std::vector<Group> groups;
  for (std::size_t i = 0; i < keys.size();) {
    Group one;
    one.measures.push_back(to_string(keys[i].measure));
    const Measure measure = keys[i].measure;
    for (; i < keys.size() && keys[i].measure == measure; ++i) one.regions.push_back(keys[i].region);
    const auto same =
        std::find_if(groups.begin(), groups.end(), [&](const Group& group) { return group.regions == one.regions; });
    if (same == groups.end()) {
      groups.push_back(std::move(one));
    } else {
      same->measures.push_back(one.measures[0]);
    }
  }
  std::stable_partition(groups.begin(), groups.end(), [](const Group& group) { return group.whole_alone(); });
  std::string text;
  for (const Group& group : groups) {
    if (!text.empty()) text += ", and ";
    text += list_text(group.measures);
    if (group.whole_alone()) continue;
    std::vector<std::string> regions;
    for (const std::string& region : group.regions) regions.push_back(region_text(region));
    text += " in " + list_text(regions);
  }
  return text;
}

std::string times_text(double ratio) {
  return number_text(ratio) + (ratio < 1 ? " of" : " times");
}

std::string verdict_text(Verdict verdict) {
  switch (verdict) {
    case Verdict::better:
      return "better";
    case Verdict::worse:
      return "worse";
    case Verdict::undecided:
      break;
  }
  return "undecided";
}

std::string verdict_text(const ComparedRatio& ratio) {
  if (ratio.equal()) return "equal";
  return verdict_text(ratio.verdict) + undecided_reason(ratio);
}

std::string undecided_reason(const ComparedRatio& ratio) {
  if (ratio.verdict != Verdict::undecided) return {};
  if (ratio.few_pixels_decide) return ", a few pixels decide it";
  return ratio.different_calls ? ", rendered by different calls" : "";
}

std::string list_text(std::vector<std::string> items, std::size_t most) {
  if (items.size() > most) {
    const std::size_t left_out = items.size() - (most - 1);
    items.resize(most - 1);
    items.push_back(std::to_string(left_out) + " others");
  }
  std::string text;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i > 0) text += i + 1 == items.size() ? " and " : ", ";
    text += items[i];
  }
  return text;
}

std::string sentence_of(const std::vector<std::string>& clauses) {
  std::string text;
  for (const std::string& clause : clauses) text += (text.empty() ? "" : "; ") + clause;
  return text.empty() ? text : text + ".";
}

std::string capital(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = char(text[0] - 'a' + 'A');
  return text;
}

}  // namespace helio
