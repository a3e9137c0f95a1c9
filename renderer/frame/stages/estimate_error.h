// Pass: estimates the error of the whole region from its two halves (film/estimate/error_estimate.h).
#pragma once

#include "renderer/film/estimate/error_estimate.h"
#include "renderer/frame/stages/sweeps.h"

namespace helio {

using MeasurePiece = SweepPiece<ErrorEstimate>;
using MeasurePass = SweepPass<ErrorEstimate>;

}  // namespace helio
