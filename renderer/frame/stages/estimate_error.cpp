#include "renderer/frame/stages/estimate_error.h"

#include "renderer/frame/picture_state.h"

namespace helio {

EstimateError::EstimateError(const Film& film, const PixelRect& region)
    : FrameStage(StageId::measure), estimate_(film, region) {}

void EstimateError::run(int sweep, std::size_t part, TraceStats&) {
  estimate_.run(sweep, part);
}

void EstimateError::finish_sweep(int sweep) {
  estimate_.finish_sweep(sweep);
}

void EstimateError::note(PictureState& picture) {
  FrameState& state = picture.state;
  state.measured = {state.total(), result()};
  state.round.measured = state.round.samples;
}

}  // namespace helio
