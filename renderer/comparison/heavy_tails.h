// Detects means over seeds that rare, large errors decide.
#pragma once

#include <span>

namespace helio {

// True if other seeds may come to quite another mean, because rare errors decide it.
//
// errors: of one mode at one budget, one for each seed. outlier_shares: of each seed, in the same order, the part of
// its squared error that the 0.1 % of pixels with the largest have (Measure::outlier_share); empty where that is not
// known or the errors are not squared ones.
//
// Pixels are the better witness: the share is at least one half in the seed with the largest error, or in all seeds
// together, each counted by its error. Ten numbers alone cannot tell the tail of a Pareto distribution from that of a
// log-normal one: who finds the first in 95 % of cases takes the second for it in half of them. Positive errors are
// therefore compared by the likelihood of their logarithms, exponential (a Pareto tail of exponent 1.5 or less) or
// normal with a sigma of 2.5 or more against normal with a sigma of 1 or less:
// - pixels known: only a clear difference counts. Of seeds whose outliers have 1 to 6 % of the error, so that the
//   pixels do not say it, it is then missed often (said of ten seeds: Pareto exponent 1: 57 %, 1.5: 52 %, log-normal
//   sigma 2: 80 %, 2.5: 94 %; of five: Pareto 12 to 21 %, log-normal sigma 2: 60 %; of twenty: 88 % or more), and
//   seldom said falsely (log-normal sigma 1: 5 % for five and ten). A threshold that found ten seeds' Pareto tails in
//   70 % of cases would take sigma 1 for one in 10 %, that of the next line in 57 %;
// - pixels not known, ten seeds or more: heavy tails are found in 95 % of cases, and false alarms accepted (ten seeds,
//   log-normal sigma 1: 57 %, sigma 0.3: 38 %, normal with a deviation of 0.3 of the mean: 17 %, of 0.1: 0 %; twenty
//   seeds: 7 % or fewer);
// - fewer than ten seeds: as for known pixels; below kLeastSeeds, numbers say nothing.
// Errors of which some are not positive: one is more than 12 times as far from the median as the median deviation, of
// eight seeds or more.
bool few_pixels_decide(std::span<const double> errors, std::span<const double> outlier_shares = {});

}  // namespace helio
