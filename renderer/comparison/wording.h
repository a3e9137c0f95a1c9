// Numbers, intervals and lists as the sentences of a comparison have them.
#pragma once

#include <cstddef>
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

// "relative MSE", "relative MSE in the dark half", "relative MSE in the region window".
std::string measure_text(const ValueKey& key);

// Measures of the same regions together: "DSSIM, and MSE and relative MSE in the whole picture and the dark half".
std::string measures_text(const std::vector<ValueKey>& keys);

// "0.25 of", "2 times".
std::string times_text(double ratio);

// "better", "worse", "undecided".
std::string verdict_text(Verdict verdict);

// The same, "equal", or why it is undecided: "undecided, a few pixels decide it".
std::string verdict_text(const ComparedRatio& ratio);

// ", a few pixels decide it"; empty where nothing but the interval leaves it undecided.
std::string undecided_reason(const ComparedRatio& ratio);

// "a", "a and b", "a, b and c"; of more than `most` items the first ones, "and 3 others".
std::string list_text(std::vector<std::string> items, std::size_t most = 12);

// The clauses divided by semicolons, with a full stop; empty without clauses.
std::string sentence_of(const std::vector<std::string>& clauses);

// With the first letter a capital one; not for texts that start with a mode's name.
std::string capital(std::string text);

}  // namespace helio
