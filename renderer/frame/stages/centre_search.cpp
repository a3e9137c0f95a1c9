#include "renderer/frame/stages/centre_search.h"

#include "renderer/frame/picture_state.h"
#include "renderer/frame/stages/temporal_reprojection.h"

namespace helio {

CentreSearch::CentreSearch(Film& film, const PixelRect& region, PictureHistory& history, const PixelFilter& filter)
    : FrameStage(StageId::centres),
      history_(history),
      windows_(transfer_windows(region)),
      centres_(history.film_scene(), film, region, history.film_pose(), filter) {}

void CentreSearch::run(int sweep, std::size_t part, TraceStats&) {
  if (sweep == 0) {
    rays_ += centres_.find(windows_[part]);
  } else if (sweep == 1) {
    rays_ += centres_.find_borders(windows_[part]);
  } else {
    centres_.settle(windows_[part]);
  }
}

void CentreSearch::finish_sweep(int sweep) {
  if (sweep + 1 == sweeps()) history_.centres_found();
}

void CentreSearch::note(PictureState& picture) {
  picture.search_rays += rays_;
}

}  // namespace helio
