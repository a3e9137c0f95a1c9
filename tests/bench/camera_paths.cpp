#include "camera_paths.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "renderer/base/camera_limits.h"

namespace helio::bench {

namespace {

constexpr double kParallel = 1e-9;  // squared sine below which a view counts as vertical

// Rodrigues' formula; axis is unit.
V3d rotated(const V3d& v, const V3d& axis, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  const double c = std::cos(angle), s = std::sin(angle);
  return v * c + cross(axis, v) * s + axis * (dot(axis, v) * (1 - c));
}

V3d vertical_of(const CameraPose& pose) {
  const V3d y(0, 1, 0);
  return length_squared(cross(pose.forward, y)) > kParallel ? y : pose.up;
}

void magnify(CameraPose& pose, double factor) {
  if (pose.projection == Projection::orthographic) {
    pose.half_height = std::clamp(pose.half_height / factor, kMinCameraLength, kMaxCameraLength);
  } else {
    pose.vertical_fov = std::clamp(2 * std::atan(std::tan(pose.vertical_fov / 2) / factor), kMinFov, kMaxFov);
  }
}

// To the scene's own view in `steps` steps.
std::vector<double> arrival(int steps) {
  std::vector<double> amounts;
  for (int i = -steps; i <= 0; ++i) amounts.push_back(i);
  return amounts;
}

std::vector<double> out_and_back(int steps) {
  std::vector<double> amounts;
  for (int i = 0; i <= 2 * steps; ++i) amounts.push_back(std::min(i, 2 * steps - i));
  return amounts;
}

}  // namespace

CameraPose moved(const CameraPose& home, const ViewStep& step, double amount) {
  if (amount == 0) return home;
  CameraPose pose = home;
  const V3d axis = vertical_of(home), by = step.move * amount;
  pose.position += home.right * by.x + home.up * by.y + home.forward * by.z;
  if (step.orbit_degrees != 0) {
    const V3d pivot = pose.position + home.forward * step.orbit_distance;
    pose.position = pivot + rotated(pose.position - pivot, axis, step.orbit_degrees * amount);
  }
  if (const double turn = (step.turn_degrees + step.orbit_degrees) * amount; turn != 0) {
    pose.forward = normalize(rotated(home.forward, axis, turn));
    pose.right = rotated(home.right, axis, turn);
    pose.right = normalize(pose.right - pose.forward * dot(pose.right, pose.forward));
    pose.up = cross(pose.right, pose.forward);
  }
  if (step.magnification != 1) magnify(pose, std::pow(step.magnification, amount));
  return pose;
}

std::vector<CameraPose> views_of(const CameraPath& path, const CameraPose& home) {
  std::vector<CameraPose> views;
  for (const double amount : path.amounts) views.push_back(moved(home, path.step, amount));
  return views;
}

std::vector<CameraPath> camera_paths(double depth) {
  std::vector<CameraPath> paths;
  for (const int degrees : {5, 10, 20, 50}) {
    paths.push_back({"turn-" + std::to_string(degrees), {.turn_degrees = double(degrees)}, arrival(100 / degrees)});
  }
  paths.push_back({"translate", {.move = {0.1 * depth, 0, 0}}, arrival(1)});
  paths.push_back({"orbit", {.orbit_degrees = 5, .orbit_distance = depth}, arrival(20)});
  paths.push_back({"zoom", {.magnification = std::pow(2.0, 0.25)}, arrival(4)});
  paths.push_back({"out-and-back", {.turn_degrees = 2, .move = {0.02 * depth, 0, 0}}, out_and_back(5)});
  paths.push_back({"tiny-moves", {.turn_degrees = 0.01, .move = {2e-4 * depth, 0, 0}}, out_and_back(500)});
  paths.push_back({"jump", {.turn_degrees = 120}, arrival(1)});
  return paths;
}

Result<CameraPath> find_camera_path(const std::string& name, double depth) {
  std::string names;
  for (CameraPath& path : camera_paths(depth)) {
    if (path.name == name) return std::move(path);
    names += (names.empty() ? "" : ", ") + path.name;
  }
  return Error{ErrorCode::not_found, "'" + name + "' is none of " + names, "camera path"};
}

}  // namespace helio::bench
