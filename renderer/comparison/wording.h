// Numbers, intervals and lists as the sentences of a comparison have them.
#pragma once

#include <string>
#include <vector>

#include "renderer/comparison/comparison_table.h"
#include "renderer/comparison/seed_values.h"

namespace helio {

// Three significant digits.
std::string number_text(double value);

// "95 %: 0.38 to 0.47", or "no interval".
std::string interval_text(const Interval& interval);

// "64 samples per pixel", "0.5 s".
std::string budget_text(const ComparisonScript& script, double at);

// "relmse", "relmse of the dark half", "relmse of the region window".
std::string measure_text(Measure measure, const std::string& region);

// "a", "a and b", "a, b and c".
std::string list_text(const std::vector<std::string>& items);

}  // namespace helio
