// Moves of a camera: what a mouse would do, as pure functions.
#pragma once

#include "heliograph/v1/types.pb.h"
#include "renderer/base/math.h"
#include "renderer/base/result.h"

namespace helio {

// Where a camera stands and how it is held. right = cross(forward, up); all unit, up perpendicular to forward.
struct CameraFrame {
  V3d position{0, 0, 0};
  V3d forward{0, 0, -1};
  V3d up{0, 1, 0};
};

// invalid_argument: a view by name (scene_camera) has no frame of its own, and neither has one without a position, with
// its target at its position, an up vector along the view, or anything that is not finite.
Result<CameraFrame> camera_frame(const heliograph::v1::CameraView& view);

// The view with another place and orientation; field of view, lens and projection stay.
heliograph::v1::CameraView with_frame(heliograph::v1::CameraView view, const CameraFrame& frame);

// Turns the camera on the spot about the vertical through it (world y, or its own up vector when it looks along y).
// Positive: to the left.
CameraFrame turned(const CameraFrame& frame, double degrees);

// Carries the camera around `pivot`, about the vertical, keeping the pivot where it is in the picture. Positive:
// counter-clockwise seen from above.
CameraFrame orbited(const CameraFrame& frame, const V3d& pivot, double degrees);

// Shifts the camera along its own axes; `offset` is (right, up, forward) in scene units.
CameraFrame moved(const CameraFrame& frame, const V3d& offset);

// The frame; invalid_argument where motions have led it beyond coordinates of 1e12.
Result<CameraFrame> within_range(const CameraFrame& frame);

}  // namespace helio
