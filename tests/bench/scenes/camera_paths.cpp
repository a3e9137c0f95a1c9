#include "tests/bench/scenes/camera_paths.h"

#include <cstdlib>

namespace helio::bench {

CameraPose moved(const CameraPose& home, const ViewStep& step, double amount) {
  if (amount == 0) return home;
  const CameraFrame frame = stepped({home.position, home.forward, home.up}, step, amount);
  CameraPose pose = home;
  pose.position = frame.position;
  if (step.turn_degrees != 0 || step.orbit_degrees != 0) {
    pose.forward = normalize(frame.forward);
    pose.right = normalize(cross(pose.forward, frame.up));
    pose.up = cross(pose.right, pose.forward);
  }
  if (pose.projection == Projection::orthographic) {
    pose.half_height = magnified_half_height(pose.half_height, step, amount);
  } else {
    pose.vertical_fov = magnified_fov(pose.vertical_fov, step, amount);
  }
  return pose;
}

std::vector<CameraPose> views_of(const NamedPath& path, const CameraPose& home) {
  std::vector<CameraPose> views;
  for (const double amount : path.amounts) views.push_back(moved(home, path.step, amount));
  return views;
}

std::vector<NamedPath> camera_paths(double depth) {
  std::vector<NamedPath> paths;
  const auto add = [&](const std::string& name, const PathScale& scale, const std::string& as) {
    auto path = named_path(name, depth, scale);
    if (!path) std::abort();  // names and scales are those below
    path->name = as;
    paths.push_back(std::move(*path));
  };
  for (const int degrees : {5, 10, 20, 50})
    add("turn", {.step = degrees, .steps = 100 / degrees}, "turn-" + std::to_string(degrees));
  for (const char* name : kPathNames) {
    if (std::string(name) != "turn") add(name, {}, name);
  }
  return paths;
}

Result<NamedPath> find_camera_path(const std::string& name, double depth) {
  std::string names;
  for (NamedPath& path : camera_paths(depth)) {
    if (path.name == name) return std::move(path);
    names += (names.empty() ? "" : ", ") + path.name;
  }
  return Error{ErrorCode::not_found, "'" + name + "' is none of " + names, "camera path"};
}

}  // namespace helio::bench
