// A drag of the camera of which previews are looked at, and how much they flicker.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "tests/bench/scenes/error_scenes.h"

namespace helio::bench {

struct PreviewDrag {
  RenderSettings settings;     // with previews
  std::vector<int> looked_at;  // views of the drag, from 1 on, ascending
  // Of a view, 0 being the rest before; null: nobody looks anywhere in particular.
  std::function<Gaze(int view)> gaze = {};
};

struct DraggedPreviews {
  std::vector<LoopPicture> previews;  // of those looked at; `seconds`: of the preview alone
  std::vector<CameraPose> cameras;
  double mean_seconds = 0;  // of all of the drag
};

// After a rest of two seconds half a degree to the left a view, at the previews' rate. Every view waits for its preview,
// so none is skipped. internal: a preview failed.
Result<DraggedPreviews> drag_previews(RenderEngine& engine, const ErrorScene& scene, const PreviewDrag& what);

// Mean over pixels and channels of how the error changes from one picture of the drag to the next, where both see the
// same direction: the camera turns on the spot, so that is the same point. In units of the mean radiance. counts: of the
// second picture's pixels; null: all.
double preview_flicker(const LoopPicture& before, const ErrorScene& before_truth, const LoopPicture& after,
                       const ErrorScene& after_truth, const std::function<bool(int x, int y)>& counts = {});

}  // namespace helio::bench
