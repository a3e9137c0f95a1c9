#include "client/named_paths.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "renderer/base/camera_limits.h"

namespace helio {

namespace {

constexpr int kMaxSteps = 100000;

// Home from `steps` steps away.
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

enum class Unit { degrees, magnification, share };

struct Shape {
  Unit unit;
  double step;
  int steps;
};

constexpr double kTurnPerShare = 2 / 0.02, kTinyTurnPerShare = 0.01 / 2e-4;  // degrees

Shape shape_of(const std::string& name) {
  if (name == "turn" || name == "orbit") return {Unit::degrees, 5, 20};
  if (name == "jump") return {Unit::degrees, 120, 1};
  if (name == "zoom") return {Unit::magnification, std::pow(2.0, 0.25), 4};
  if (name == "translate") return {Unit::share, 0.1, 1};
  if (name == "out-and-back") return {Unit::share, 0.02, 5};
  return {Unit::share, 2e-4, 500};
}

void check_step(double step, Unit unit, Problems& problems) {
  const auto refuse = [&](const char* what, const char* range) {
    problems.add("step", fmt::format("{} is not {} in {}", step, what, range));
  };
  if (unit == Unit::degrees && !(std::abs(step) <= 360 && step != 0))
    refuse("a number of degrees", "[-360, 360], not 0");
  if (unit == Unit::magnification && !(step >= 0.01 && step <= 100 && step != 1)) {
    refuse("a magnification", "[0.01, 100], not 1");
  }
  if (unit == Unit::share && !(std::abs(step) <= 100 && step != 0))
    refuse("a share of the distance", "[-100, 100], not 0");
}

}  // namespace

CameraFrame stepped(const CameraFrame& home, const ViewStep& step, double amount) {
  if (amount == 0) return home;
  CameraFrame frame = moved(home, step.move * amount);
  if (step.orbit_degrees != 0) {
    frame = orbited(frame, frame.position + frame.forward * step.orbit_distance, step.orbit_degrees * amount);
  }
  if (step.turn_degrees != 0) frame = turned(frame, step.turn_degrees * amount);
  return frame;
}

double magnified_fov(double fov, const ViewStep& step, double amount) {
  if (step.magnification == 1 || amount == 0) return fov;
  const double factor = std::pow(step.magnification, amount);
  return std::clamp(2 * std::atan(std::tan(fov / 2) / factor), kMinFov, kMaxFov);
}

double magnified_half_height(double half_height, const ViewStep& step, double amount) {
  if (step.magnification == 1 || amount == 0) return half_height;
  return std::clamp(half_height / std::pow(step.magnification, amount), kMinCameraLength, kMaxCameraLength);
}

bool is_path_name(const std::string& name) {
  return std::find(std::begin(kPathNames), std::end(kPathNames), name) != std::end(kPathNames);
}

std::string path_names() {
  std::string names;
  for (const char* known : kPathNames) names += std::string(names.empty() ? "" : ", ") + known;
  return names;
}

Result<NamedPath> named_path(const std::string& name, double distance, const PathScale& scale) {
  if (!is_path_name(name)) {
    return Error{ErrorCode::not_found, "'" + name + "' is none of " + path_names(), "camera path"};
  }
  const Shape shape = shape_of(name);
  const double by = scale.step.value_or(shape.step);
  const int steps = scale.steps.value_or(shape.steps);
  Problems problems;
  check_step(by, shape.unit, problems);
  if (steps < 1 || steps > kMaxSteps) problems.add("steps", fmt::format("{} is not in [1, {}]", steps, kMaxSteps));
  if (!(distance > 0 && std::isfinite(distance)))
    problems.add("distance", fmt::format("{} is not finite and above 0", distance));
  if (!problems.empty()) return problems.to_error();

  NamedPath path{name, {}, arrival(steps)};
  if (name == "turn" || name == "jump") {
    path.step.turn_degrees = by;
  } else if (name == "orbit") {
    path.step.orbit_degrees = by;
    path.step.orbit_distance = distance;
  } else if (name == "zoom") {
    path.step.magnification = by;
  } else {
    path.step.move.x = by * distance;
    if (name != "translate") {
      path.step.turn_degrees = by * (name == "tiny-moves" ? kTinyTurnPerShare : kTurnPerShare);
      path.amounts = out_and_back(steps);
    }
  }
  return path;
}

Result<std::vector<PathView>> play_named_path(const NamedPath& path, const PathStart& start) {
  const Result<CameraFrame> home = camera_frame(start.camera);
  if (!home) return home.error();
  std::vector<PathView> views;
  for (const double amount : path.amounts) {
    heliograph::v1::CameraView camera = start.camera;
    if (amount != 0) {
      const Result<CameraFrame> there = within_range(stepped(*home, path.step, amount));
      if (!there) return there.error();
      camera = with_frame(camera, *there);
    }
    if (camera.orthographic_half_height() > 0) {
      camera.set_orthographic_half_height(magnified_half_height(camera.orthographic_half_height(), path.step, amount));
    } else {
      camera.set_vertical_fov(magnified_fov(camera.vertical_fov(), path.step, amount));
    }
    views.push_back({std::move(camera), std::nullopt, start.gaze});
  }
  return views;
}

}  // namespace helio
