#include "renderer/frame/stages/reject_history.h"

#include "renderer/frame/picture_state.h"

namespace helio {

RejectHistory::RejectHistory(Film& film, const PixelRect& region)
    : FrameStage(StageId::review), rejection_(film, region) {}

void RejectHistory::run(int sweep, std::size_t part, TraceStats&) {
  rejection_.run(sweep, part);
}

void RejectHistory::finish_sweep(int sweep) {
  rejection_.finish_sweep(sweep);
}

void RejectHistory::note(PictureState& picture) {
  picture.taken_back += rejection_.taken_back();
}

}  // namespace helio
