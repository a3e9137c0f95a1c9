// Camera paths of the benches: how a view moves, and the sequences of views that reuse is measured on.
//
// Every path ends at the scene's own view, in its very bits, so that one reference serves all of them; the paths that
// go out and come back begin there as well. Each view is placed from the scene's own by the whole of its motion, never
// from the view before: nothing adds up over a thousand steps.
#pragma once

#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/trace/camera.h"

namespace helio::bench {

// One step of a path; `amount` of them may be any number, negative ones undo.
struct ViewStep {
  double turn_degrees = 0;    // on the spot about the vertical, positive to the left
  double orbit_degrees = 0;   // about the vertical through the point `orbit_distance` ahead, positive seen from above
  double orbit_distance = 0;  // scene units, >= 0
  V3d move{0, 0, 0};          // along the camera's own right, up and forward axes, scene units, before it turns
  double magnification = 1;   // > 0; of the picture: divides the tangent of half the field of view, or the half height
};

// The vertical is world y, or the camera's own up vector where it looks along y, as for `heliograph move`. amount 0
// gives the same bits back. Fields of view are cut to what camera_limits.h allows.
CameraPose moved(const CameraPose& home, const ViewStep& step, double amount);

struct CameraPath {
  std::string name;
  ViewStep step;
  std::vector<double> amounts;  // of the views, in steps from the scene's own view; never empty, the last is 0
};

std::vector<CameraPose> views_of(const CameraPath& path, const CameraPose& home);

// The paths for a scene whose depth (scene_depth.h) is `depth` > 0:
//   turn-5, turn-10, turn-20, turn-50   turns by so many degrees a step, 100 in all (Schalk 2018, chapter 4.3)
//   translate                           to the right by a tenth of the depth, in one step
//   orbit                               100 degrees in steps of 5 around the point `depth` ahead
//   zoom                                into half the picture's size, in four steps of equal factors
//   out-and-back                        five steps away, to the right by 2 % of the depth and by 2 degrees each, and
//   back tiny-moves                          1,000 moves of 0.02 % of the depth and 0.01 degrees each: 500 away, 500
//   back jump                                from a view turned by 120 degrees, which shares nothing with the last one
std::vector<CameraPath> camera_paths(double depth);

// One of them. not_found lists the names.
Result<CameraPath> find_camera_path(const std::string& name, double depth);

}  // namespace helio::bench
