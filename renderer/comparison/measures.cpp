#include "renderer/comparison/measures.h"

namespace helio {

const char* to_string(Measure measure) {
  switch (measure) {
    case Measure::mse:
      return "mse";
    case Measure::relmse:
      return "relmse";
    case Measure::bias:
      return "bias";
    case Measure::distance_variance:
      return "distance_variance";
    case Measure::dssim:
      return "dssim";
    case Measure::flip:
      return "flip";
    case Measure::flip_median:
      return "flip_median";
    case Measure::hdr_flip:
      return "hdr_flip";
    case Measure::hdr_flip_median:
      return "hdr_flip_median";
    case Measure::flicker:
      return "flicker";
    case Measure::outlier_share:
      return "outlier_share";
    case Measure::told_rmse:
      return "told_rmse";
  }
  return "unknown";
}

bool is_error(Measure measure) {
  return measure != Measure::bias && measure != Measure::outlier_share && measure != Measure::told_rmse;
}

}  // namespace helio
