#include "client/camera_path.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "client/camera_motion.h"
#include "renderer/base/camera_limits.h"
#include "renderer/base/gaze_density.h"
#include "renderer/base/json_scan.h"
#include "renderer/base/number_range.h"

namespace helio {

namespace pb = heliograph::v1;
using nlohmann::json;

namespace {

constexpr std::size_t kMaxViews = 1000000;
constexpr int kMaxDepth = 16;          // of nested JSON values; a path needs four
constexpr std::size_t kMaxShown = 60;  // bytes of a value in a message
constexpr double kDegree = std::numbers::pi / 180;

// Looks for what makes a text no path before a tree is built: it is not JSON, a number is beyond what a double holds,
// or values nest deeper than the functions that walk the tree may go.
struct TextCheck : JsonScan {
  std::size_t position = 0;
  std::string problem;
  int depth = 0;

  bool start_object(std::size_t) override { return enter(); }
  bool end_object() override { return leave(); }
  bool start_array(std::size_t) override { return enter(); }
  bool end_array() override { return leave(); }
  bool parse_error(std::size_t at, const std::string&, const json::exception& fault) override {
    position = at;
    problem = fault.what();  // "[json.exception.parse_error.101] parse error at line ...: syntax error ..."
    if (const std::size_t end = problem.find("] "); end != std::string::npos) problem = problem.substr(end + 2);
    return false;
  }

 private:
  bool enter() {
    if (++depth <= kMaxDepth) return true;
    problem = fmt::format("values are nested more than {} deep", kMaxDepth);
    return false;
  }
  bool leave() { return --depth, true; }
};

std::string shown(const json& value) {
  std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() > kMaxShown) text = text.substr(0, kMaxShown) + "...";
  return text;
}

// Reads the keys of one view, noting each problem with its place and each key that it was asked for.
class ViewReader {
 public:
  ViewReader(const json& view, std::string place, Problems& problems)
      : view_(view), place_(std::move(place)), problems_(problems) {}

  bool has(const char* key) const { return view_.contains(key); }
  void problem(const std::string& key, const std::string& message) { problems_.add(place_ + "/" + key, message); }

  std::optional<double> number(const char* key, const NumberRange& range, const std::string& words = {}) {
    const json* value = find(key);
    if (!value) return std::nullopt;
    const double number = value->is_number() ? value->get<double>() : std::nan("");
    if (range.contains(number)) return number;
    problem(key, shown(*value) + " is not a number in " + (words.empty() ? range.to_string() : words));
    return std::nullopt;
  }

  std::optional<std::int64_t> integer(const char* key, std::int64_t low, std::int64_t high) {
    const json* value = find(key);
    if (!value) return std::nullopt;
    if (value->is_number_integer() && *value >= low && *value <= high) return value->get<std::int64_t>();
    problem(key, fmt::format("{} is not an integer in [{}, {}]", shown(*value), low, high));
    return std::nullopt;
  }

  std::optional<V3d> vector(const char* key) {
    const json* value = find(key);
    if (!value) return std::nullopt;
    if (value->is_array() && value->size() == 3 &&
        std::all_of(value->begin(), value->end(), [](const json& v) { return v.is_number(); })) {
      const V3d v((*value)[0].get<double>(), (*value)[1].get<double>(), (*value)[2].get<double>());
      if (is_finite(v)) return v;
    }
    problem(key, shown(*value) + " is not three finite numbers [x, y, z]");
    return std::nullopt;
  }

  // The key's gaze; none: null. What it was stays where the key is absent.
  void gaze(const char* key, std::optional<pb::Gaze>& gaze) {
    const json* value = find(key);
    if (!value) return;
    if (value->is_null()) return gaze.reset();
    constexpr NumberRange kRange{-kMostGazePixels, kMostGazePixels};
    const auto inside = [&](const json& v) { return v.is_number() && kRange.contains(v.get<double>()); };
    if (!value->is_array() || value->size() != 2 || !std::all_of(value->begin(), value->end(), inside))
      return problem(key, shown(*value) + " is not two numbers [x, y] in " + kRange.to_string() + ", or null");
    gaze.emplace();
    gaze->set_x((*value)[0].get<double>());
    gaze->set_y((*value)[1].get<double>());
  }

  std::optional<std::string> text(const char* key) {
    const json* value = find(key);
    if (!value) return std::nullopt;
    if (value->is_string()) return value->get<std::string>();
    if (value->is_number_unsigned()) return value->dump();
    problem(key, shown(*value) + " is not a name");
    return std::nullopt;
  }

  void report_unknown_keys() {
    for (const auto& [key, value] : view_.items()) {
      if (std::find(known_.begin(), known_.end(), key) == known_.end()) problem(key, "is not a key of a view");
    }
  }

 private:
  const json* find(const char* key) {
    known_.push_back(key);
    const auto at = view_.find(key);
    return at == view_.end() ? nullptr : &*at;
  }

  const json& view_;
  std::string place_;
  Problems& problems_;
  std::vector<std::string> known_;
};

std::optional<pb::Budget> read_budget(ViewReader& reader) {
  const auto samples = reader.integer("samples", std::int64_t(kSampleBudget.low), std::int64_t(kSampleBudget.high));
  const auto time = reader.number("time_s", kPositiveNumber);
  const auto error = reader.number("error", kPositiveNumber);
  if (!samples && !time && !error) return std::nullopt;
  pb::Budget budget;
  if (samples) budget.set_samples(static_cast<std::uint32_t>(*samples));
  if (time) budget.set_time_s(*time);
  if (error) budget.set_error(*error);
  return budget;
}

void read_lens(ViewReader& reader, pb::CameraView& camera) {
  if (const auto fov = reader.number("fov_degrees", {0.1, 179})) {
    if (camera.orthographic_half_height() > 0) reader.problem("fov_degrees", "does not fit an orthographic camera");
    camera.set_vertical_fov(*fov * kDegree);
  }
  if (const auto radius = reader.number("lens_radius", {0, kMaxLensRadius}, kLensRadiusRange)) {
    camera.set_lens_radius(*radius);
  }
  if (const auto focus = reader.number("focus_distance", {kMinCameraLength, kMaxCameraLength}, kCameraLengthRange)) {
    camera.set_focus_distance(*focus);
  }
}

// What one view does to the camera, so that "repeat" can do it again.
struct Step {
  std::optional<V3d> position, target, up, move;
  std::optional<double> turn, orbit;
  V3d pivot{0, 0, 0};

  Result<CameraFrame> apply(const CameraFrame& before) const {
    CameraFrame frame = before;
    if (position) frame.position = *position;
    if (target) {
      pb::CameraView view = with_frame({}, frame);
      pb::Vec3& point = *view.mutable_look_at()->mutable_target();
      point.set_x(target->x);
      point.set_y(target->y);
      point.set_z(target->z);
      const V3d y = up.value_or(V3d(0, 1, 0));
      pb::Vec3& vertical = *view.mutable_look_at()->mutable_up();
      vertical.set_x(y.x);
      vertical.set_y(y.y);
      vertical.set_z(y.z);
      Result<CameraFrame> aimed = camera_frame(view);
      if (!aimed) return aimed;
      frame = *aimed;
    }
    if (turn) frame = turned(frame, *turn);
    if (orbit) frame = orbited(frame, pivot, *orbit);
    if (move) frame = moved(frame, *move);
    return within_range(frame);
  }
};

Step read_step(ViewReader& reader, const V3d& pivot) {
  Step step;
  step.position = reader.vector("position");
  step.target = reader.vector("target");
  step.up = reader.vector("up");
  step.turn = reader.number("turn_degrees", {-360000, 360000});
  step.orbit = reader.number("orbit_degrees", {-360000, 360000});
  step.pivot = reader.vector("pivot").value_or(pivot);
  step.move = reader.vector("move");
  if (reader.has("up") && !reader.has("target")) reader.problem("up", "is only valid with \"target\"");
  if (reader.has("pivot") && !reader.has("orbit_degrees")) {
    reader.problem("pivot", "is only valid with \"orbit_degrees\"");
  }
  return step;
}

constexpr const char* kPlacing[] = {"position",      "target", "up",   "turn_degrees",
                                    "orbit_degrees", "pivot",  "move", "fov_degrees"};

}  // namespace

std::string camera_names(const std::vector<pb::SceneCamera>& cameras) {
  constexpr std::size_t kShown = 16;
  std::string names;
  for (std::size_t i = 0; i < std::min(cameras.size(), kShown); ++i)
    names += (i == 0 ? "'" : ", '") + cameras[i].name() + "'";
  if (cameras.size() > kShown) names += fmt::format(" and {} more", cameras.size() - kShown);
  return names;
}

const pb::SceneCamera* find_camera(const std::vector<pb::SceneCamera>& cameras, const std::string& name) {
  for (const pb::SceneCamera& camera : cameras) {
    if (camera.name() == name) return &camera;
  }
  std::size_t number = 0;
  const auto [end, problem] = std::from_chars(name.data(), name.data() + name.size(), number);
  const bool decimal = problem == std::errc() && end == name.data() + name.size();
  return decimal && number < cameras.size() ? &cameras[number] : nullptr;
}

Result<std::vector<PathView>> parse_camera_path(const std::string& text, const std::string& name,
                                                const PathStart& start) {
  TextCheck check;
  if (!json::sax_parse(text, &check)) {
    const std::string place = check.position > 0 ? name + "@" + std::to_string(check.position) : name;
    return Error{ErrorCode::invalid_argument, check.problem, place};
  }
  const json path = json::parse(text);
  if (!path.is_object() || !path.contains("views") || !path["views"].is_array() || path["views"].empty()) {
    return Error{ErrorCode::invalid_argument, "must be an object whose \"views\" is an array of at least one view",
                 name};
  }
  Problems problems;
  for (const auto& [key, value] : path.items()) {
    if (key != "views") problems.add(name + "/" + key, "is not a key of a camera path");
  }

  pb::CameraView camera = start.camera;
  std::optional<pb::Gaze> gaze = start.gaze;
  std::vector<PathView> views;
  std::size_t index = 0;
  for (const json& view : path["views"]) {
    const std::string place = fmt::format("{}/views/{}", name, index++);
    if (!view.is_object()) {
      problems.add(place, shown(view) + " is not an object");
      continue;
    }
    ViewReader reader(view, place, problems);
    if (const auto named = reader.text("camera")) {
      const pb::SceneCamera* found = find_camera(start.cameras, *named);
      if (found) camera = found->view();
      if (!found) reader.problem("camera", "'" + *named + "' is none of " + camera_names(start.cameras));
      for (const char* key : kPlacing) {
        if (reader.has(key)) reader.problem(key, "does not go with \"camera\"");
      }
    }
    const Step step = read_step(reader, start.pivot);
    read_lens(reader, camera);
    reader.gaze("gaze", gaze);
    const std::optional<pb::Budget> budget = read_budget(reader);
    const std::int64_t repeat = reader.integer("repeat", 1, 100000).value_or(1);
    reader.report_unknown_keys();
    if (!problems.empty()) continue;  // places no longer follow from each other
    for (std::int64_t i = 0; i < repeat; ++i) {
      const Result<CameraFrame> before = camera_frame(camera);
      const Result<CameraFrame> after = before ? step.apply(*before) : before;
      if (!after) {
        problems.add(place, after.error().to_string());
        break;
      }
      camera = with_frame(camera, *after);
      views.push_back({camera, budget, gaze});
    }
    if (views.size() > kMaxViews) {
      problems.add(name, fmt::format("more than {} views", kMaxViews));
      break;
    }
  }
  if (!problems.empty()) return problems.to_error();
  return views;
}

Result<std::vector<PathView>> play_motion(const CameraMotion& motion, const PathStart& start) {
  const Result<CameraFrame> first = camera_frame(start.camera);
  if (!first) return first.error();
  std::vector<PathView> views;
  for (int i = 0; i <= motion.steps; ++i) {
    const double share = double(i) / motion.steps;
    CameraFrame frame = *first;
    if (motion.turn_degrees != 0) frame = turned(frame, motion.turn_degrees * share);
    if (motion.orbit_degrees != 0) frame = orbited(frame, start.pivot, motion.orbit_degrees * share);
    const Result<CameraFrame> there = within_range(moved(frame, motion.move * share));
    if (!there) return there.error();
    views.push_back({with_frame(start.camera, *there), std::nullopt, start.gaze});
  }
  return views;
}

}  // namespace helio
