// One mode against another, in every measure of error: at equal error, equal time, equal samples, and in speed.
#pragma once

#include <cstddef>
#include <vector>

#include "renderer/comparison/comparison_table.h"
#include "renderer/comparison/seed_values.h"

namespace helio {

// Ratios of a path are of the means over its views. `mode` and `baseline` are indices of the script's modes, at least
// one budget of both must have seeds for there to be anything. In this order:
//
// speed, where budgets are samples: the geometric mean over seeds, at each budget.
// Then of each measure (is_error) and region:
// equal_samples, where budgets are samples: at each budget.
// equal_time: where budgets are seconds, at each budget for which both took as long, up to 5 %; else at the baseline's
// times that the mode's curve encloses, and at the latest time that both have. Curves are the means over seeds, joined
// by straight lines in the logarithms of time and error; nothing is extrapolated. equal_error: at the baseline's errors
// that the mode's curve encloses, and at the lowest error that both have.
//
// Preview modes of a path have equal_time alone, of means over all views but the first for both sides: at the seconds
// of the previews that belong to each budget, where the other mode's curve encloses them. Of two preview modes: at the
// budgets where their previews took as long, up to 5 %.
//
// Nothing is decided where a few pixels decide an error that the ratio is made of (few_pixels.h), nor by ratios at or
// of times between modes of which more than a fifth of the seeds come from calls that the other's seeds do not: these
// took no turns.
//
// No ratio is made of a mean error that is not positive: errors without the reference's noise may be 0 or below it,
// where the reference does not resolve them, and have no logarithm. A curve ends before such a point.
std::vector<ComparedRatio> compare_modes(const ComparisonScript& script, const SeedTable& table, std::size_t mode,
                                         std::size_t baseline);

}  // namespace helio
