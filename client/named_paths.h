// Camera paths by name: the sequences of views that `heliograph move --path NAME` plays and that benches measure reuse
// on.
//
// Every path ends at the home view, so that one reference serves all of them; those that go out and come back begin
// there as well. Each view is placed from home by the whole of its motion, never from the view before: nothing adds up
// over a thousand steps.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/camera_motion.h"
#include "client/camera_path.h"
#include "renderer/base/result.h"

namespace helio {

// One step of a path; `amount` of them may be any number, negative ones undo.
struct ViewStep {
  double turn_degrees = 0;    // on the spot about the vertical, positive to the left
  double orbit_degrees = 0;   // about the vertical through the point `orbit_distance` ahead, positive seen from above
  double orbit_distance = 0;  // scene units, >= 0
  V3d move{0, 0, 0};          // along the camera's own right, up and forward axes, scene units, before it turns
  double magnification = 1;   // > 0; of the picture: divides the tangent of half the field of view, or the half height
};

// amount 0 gives the same bits back. The vertical is that of turned().
CameraFrame stepped(const CameraFrame& home, const ViewStep& step, double amount);
// Lenses after `amount` steps, cut to what camera_limits.h allows: full angle in radians, half height of an
// orthographic view.
double magnified_fov(double fov, const ViewStep& step, double amount);
double magnified_half_height(double half_height, const ViewStep& step, double amount);

struct NamedPath {
  std::string name;
  ViewStep step;
  std::vector<double> amounts;  // of the views, in steps from home; never empty, the last is 0
};

struct PathScale {
  // Of a step: degrees (turn, orbit, jump; [-360, 360], not 0), magnification (zoom; [0.01, 100], not 1) or share of
  // the distance (translate, out-and-back, tiny-moves; [-100, 100], not 0). Absent: the path's own.
  std::optional<double> step = std::nullopt;
  std::optional<int> steps = std::nullopt;  // [1, 100000], one way; absent: the path's own
};

inline constexpr const char* kPathNames[] = {"turn",         "translate",  "orbit", "zoom",
                                             "out-and-back", "tiny-moves", "jump"};
bool is_path_name(const std::string& name);
std::string path_names();  // "turn, translate, ..."

// For a view of something `distance` > 0 scene units away:
//   turn          by 5 degrees a step, 20 steps (Schalk 2018, chapter 4.3)
//   translate     to the right by a tenth of the distance, in one step
//   orbit         by 5 degrees a step around the point `distance` ahead, 20 steps
//   zoom          into half the picture's size, in four steps of equal factors
//   out-and-back  five steps away, to the right by 2 % of the distance and by 2 degrees each, and back
//   tiny-moves    1,000 moves of 0.02 % of the distance and 0.01 degrees each: 500 away, 500 back
//   jump          from a view turned by 120 degrees, which shares nothing with the last one
// not_found lists the names; invalid_argument: a scale out of its range.
Result<NamedPath> named_path(const std::string& name, double distance, const PathScale& scale = {});

// The views of a path whose home is the start's camera. invalid_argument: a view is out of the range of coordinates.
Result<std::vector<PathView>> play_named_path(const NamedPath& path, const PathStart& start);

}  // namespace helio
