// A mean over seeds and how certain it is.
#pragma once

#include <span>

namespace helio {

struct Interval {
  double mean = 0;
  double low = 0, high = 0;  // 95 %; 0 where not known
  bool known = false;        // false below kLeastSeeds values, and where nothing can be said
};

// With fewer seeds an interval says more of its assumptions than of the pictures.
inline constexpr int kLeastSeeds = 5;

// The arithmetic mean with a 95 % interval for the mean of the distribution that the values are drawn from.
//
// Student's t, where a value is not positive. Positive values are often skewed, and t is then too narrow (it holds the
// mean of log-normal values with sigma 1 in 84 % of cases, for ten of them): their interval is the modified Cox
// interval of log-normal values (Olsson 2005, "Confidence intervals for the mean of a log-normal distribution"), the
// upper end at least that of t. Of values of small spread it is t's. Logarithms with a long tail to small values
// (skewness below -1.4) are no sign of log-normal values, but of values near 0: these have t again.
//
// Too narrow all the same: sums and mixtures of normal and log-normal values of sigma 1 (83 to 90 % instead of 95), and
// tails heavier than log-normal (heavy_tails.h). Equal values: an interval without width. Values must be finite;
// without any the mean is 0. Neither end is ever infinite: known is then false.
Interval mean_interval(std::span<const double> values);

// Cut to [low, high], in which the mean lies, up to rounding.
Interval cut(Interval interval, double low, double high);

// Where the mean has another error beside that of its seeds, independent of it, normal and of this standard error.
Interval widened(Interval interval, double standard_error);

}  // namespace helio
