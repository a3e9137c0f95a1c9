// A camera path: the views that `heliograph move` plays, from a JSON file or from a simple motion.
//
// The file is an object with one key, "views", an array of objects played in order. What a view does not name stays as
// in the view before; the first follows the start camera.
//
// Coordinates of positions and targets lie in [-1e12, 1e12].
//
//   place it      "camera": NAME           a camera of the scene (or its number), alone with "samples"... and "repeat"
//                 "position": [x, y, z]    scene units
//                 "target": [x, y, z]      the point looked at
//                 "up": [x, y, z]          default [0, 1, 0]; only with "target"
//   or move it    "turn_degrees": A        on the spot, positive to the left, about the vertical
//                 "orbit_degrees": A       around "pivot": [x, y, z] (default: the centre of the scene's bounds)
//                 "move": [r, u, f]        along its own right, up and forward axes, scene units
//   lens          "fov_degrees": A         vertical, [0.1, 179]
//                 "lens_radius": L         [0, 1e12], 0: pinhole
//                 "focus_distance": L      [1e-12, 1e12]
//   gaze          "gaze": [x, y]           where somebody looks, pixels from the picture's upper left corner,
//                                          [-1e6, 1e6]; null: nowhere in particular
//   budget        "samples": N, "time_s": T, "error": E   for this view, instead of the command's budget
//   again         "repeat": N              plays the view N times, [1, 100000]; a motion goes on each time
//
//   {"views": [{"camera": "Main", "samples": 256}, {"turn_degrees": 5, "samples": 64, "repeat": 20}]}
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "heliograph/v1/render_service.pb.h"
#include "renderer/base/math.h"
#include "renderer/base/result.h"

namespace helio {

struct PathView {
  heliograph::v1::CameraView camera;
  std::optional<heliograph::v1::Budget> budget;  // of this view; none: the command's
  std::optional<heliograph::v1::Gaze> gaze = {};
};

// What a path starts from.
struct PathStart {
  heliograph::v1::CameraView camera;  // complete, with a position
  V3d pivot{0, 0, 0};                 // of orbits that name none
  std::vector<heliograph::v1::SceneCamera> cameras;
  std::optional<heliograph::v1::Gaze> gaze = {};
};

// `name` prefixes the places in errors ("path.json/views/3/turn_degrees"). invalid_argument: every problem found.
Result<std::vector<PathView>> parse_camera_path(const std::string& json, const std::string& name,
                                                const PathStart& start);

// One camera of a scene by name, or by its number in decimal; nullptr: none such.
const heliograph::v1::SceneCamera* find_camera(const std::vector<heliograph::v1::SceneCamera>& cameras,
                                               const std::string& name);

// Their names for people: the first 16, and how many more there are.
std::string camera_names(const std::vector<heliograph::v1::SceneCamera>& cameras);

// The start view, then `steps` more, each a share of the whole motion. Degrees and scene units in total. steps >= 1.
struct CameraMotion {
  double turn_degrees = 0;
  double orbit_degrees = 0;
  V3d move{0, 0, 0};
  int steps = 1;
};
Result<std::vector<PathView>> play_motion(const CameraMotion& motion, const PathStart& start);

}  // namespace helio
