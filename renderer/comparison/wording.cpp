#include "renderer/comparison/wording.h"

#include <cstdio>

namespace helio {

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

std::string measure_text(Measure measure, const std::string& region) {
  const std::string name = to_string(measure);
  if (region.empty()) return name;
  return name + (region == kDarkHalf ? " of the dark half" : " of the region " + region);
}

std::string list_text(const std::vector<std::string>& items) {
  std::string text;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i > 0) text += i + 1 == items.size() ? " and " : ", ";
    text += items[i];
  }
  return text;
}

}  // namespace helio
