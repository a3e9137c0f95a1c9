// Measures by which pictures of sampling modes are compared: their names, and a measured value.
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace helio {

enum class Measure {
  mse,                // mean((x - r)^2)
  relmse,             // mean((x - r)^2 / (r^2 + 0.01 mean(r)^2))
  bias,               // mean(x - r) / mean(r)
  distance_variance,  // variance over pixels and channels of |x - r| (Schalk 2018, chapter 4)
  dssim,
  flip,         // mean of LDR-FLIP
  flip_median,  // its weighted median
  hdr_flip,
  hdr_flip_median,
  flicker,
  // Share of the squared relative error that the 0.1 % of pixels with the largest have, [0, 1]. Of 1,000 pixels or more
  outlier_share,
  told_rmse,  // the standard error that a mode reports of its picture
};
inline constexpr int kMeasures = int(Measure::told_rmse) + 1;

// As a noun within a sentence, without an article: "relative MSE", "variance of the distance".
const char* to_string(Measure measure);

// True if less of it is better and it is never below 0, up to the noise of the reference, so that one mode's value may
// be divided by another's. False of bias, outlier_share and told_rmse.
bool is_error(Measure measure);

// What a value of the measure can be, and so a mean of them. Of mse and relmse the reference's noise may have been
// taken off: they may be negative.
struct ValueRange {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
};
ValueRange possible_values(Measure measure);

// As the region of values of the pixels whose reference is no brighter (in luminance) than half of them.
inline constexpr const char* kDarkHalf = "dark half";

struct MeasuredValue {
  Measure measure = Measure::mse;
  std::string region;  // empty: the whole picture
  double value = 0;    // finite
  // Of bias: its standard error by the reference's noise; 0: not known, and of all others.
  double reference_error = 0;

  bool operator==(const MeasuredValue&) const = default;
};

}  // namespace helio
