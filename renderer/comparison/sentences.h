// The findings of a comparison, in sentences for the readers of its report.
#pragma once

#include <string>
#include <vector>

#include "renderer/comparison/comparison_table.h"
#include "renderer/comparison/seed_values.h"

namespace helio {

// From points and ratios that are complete; of a path, from those over all views. First which mode has the lowest
// error, then each mode against the first, preview modes in one sentence each, then what limits the answers. At most
// 12 sentences and three for each mode.
std::vector<std::string> comparison_sentences(const ComparisonScript& script, const SeedTable& seeds,
                                              const ComparisonTable& table);

}  // namespace helio
