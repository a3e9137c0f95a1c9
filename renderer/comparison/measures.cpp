#include "renderer/comparison/measures.h"

namespace helio {

const char* to_string(Measure measure) {
  switch (measure) {
    case Measure::mse:
      return "MSE";
    case Measure::relmse:
      return "relative MSE";
    case Measure::bias:
      return "bias";
    case Measure::distance_variance:
      return "variance of the distance";
    case Measure::dssim:
      return "DSSIM";
    case Measure::flip:
      return "LDR-FLIP";
    case Measure::flip_median:
      return "weighted median of LDR-FLIP";
    case Measure::hdr_flip:
      return "HDR-FLIP";
    case Measure::hdr_flip_median:
      return "weighted median of HDR-FLIP";
    case Measure::flicker:
      return "flicker";
    case Measure::outlier_share:
      return "share of outliers";
    case Measure::told_rmse:
      return "reported standard error";
  }
  return "unknown";
}

ValueRange possible_values(Measure measure) {
  switch (measure) {
    case Measure::mse:
    case Measure::relmse:
    case Measure::bias:
      return {};
    case Measure::distance_variance:
    case Measure::dssim:
    case Measure::flicker:
    case Measure::told_rmse:
      return {.low = 0};
    case Measure::flip:
    case Measure::flip_median:
    case Measure::hdr_flip:
    case Measure::hdr_flip_median:
    case Measure::outlier_share:
      return {0, 1};
  }
  return {};
}

bool is_error(Measure measure) {
  return measure != Measure::bias && measure != Measure::outlier_share && measure != Measure::told_rmse;
}

}  // namespace helio
