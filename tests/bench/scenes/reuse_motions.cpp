#include "tests/bench/scenes/reuse_motions.h"

#include <algorithm>
#include <charconv>

#include "tests/bench/scenes/camera_paths.h"

namespace helio::bench {

namespace {

constexpr std::uint32_t kRest = 256, kSamplesPerStep = 64, kMostSamplesPerStep = 65536;

ReuseGoals goals_of(const std::string& name) {
  if (name == "turn-5") return {.median_gain = 8, .worst_gain = 2, .over_paper = 2, .share_of_ceiling = {}};
  if (name == "path-5") return {.median_gain = {}, .worst_gain = {}, .over_paper = {}, .share_of_ceiling = 70};
  if (name == "translate") return {.median_gain = 5, .worst_gain = {}, .over_paper = {}, .share_of_ceiling = {}};
  return {};
}

bool begins_at_home(const std::string& name) {
  return name == "out-and-back" || name == "tiny-moves";
}

bool has_steps(const std::string& name) {
  return name.starts_with("path-") || name == "orbit" || name == "zoom" || name == "out-and-back";
}

// Of NAME@SAMPLES.
Result<std::uint32_t> samples_per_step(const std::string& name, const std::string& text) {
  if (!has_steps(name))
    return Error{ErrorCode::invalid_argument, "'" + name + "' has no steps whose samples could be chosen", "--motions"};
  std::uint32_t samples = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), samples);
  if (error != std::errc() || end != text.data() + text.size() || samples < 1 || samples > kMostSamplesPerStep)
    return Error{ErrorCode::invalid_argument,
                 "'" + text + "' is no number of samples in [1, " + std::to_string(kMostSamplesPerStep) + "]",
                 "--motions " + name};
  return samples;
}

}  // namespace

const std::vector<std::string>& reuse_motion_names() {
  static const std::vector<std::string> names = {"turn-5",  "turn-10", "turn-20",      "turn-50",   "path-5",
                                                 "path-10", "path-20", "path-50",      "translate", "orbit",
                                                 "zoom",    "jump",    "out-and-back", "tiny-moves"};
  return names;
}

const std::vector<std::string>& default_reuse_motions() {
  static const std::vector<std::string> names = {"turn-5", "path-5", "translate", "jump"};
  return names;
}

Result<ReuseMotion> reuse_motion(const std::string& text, const CameraPose& home, double depth) {
  const std::size_t at = text.find('@');
  const std::string name = text.substr(0, at);
  const std::vector<std::string>& known = reuse_motion_names();
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    std::string names;
    for (const std::string& other : known) names += (names.empty() ? "" : ", ") + other;
    return Error{ErrorCode::invalid_argument, "'" + name + "' is none of " + names, "--motions"};
  }
  const std::string of_turns = name.starts_with("path-") ? "turn-" + name.substr(5) : name;
  const auto path = find_camera_path(of_turns, depth);
  if (!path) return path.error();
  std::vector<CameraPose> poses = views_of(*path, home);
  poses.pop_back();
  if (name.starts_with("turn-")) poses.erase(poses.begin(), poses.end() - 1);
  std::uint32_t per_step = name == "tiny-moves" ? 1 : poses.size() == 1 ? kRest : kSamplesPerStep;
  if (at != std::string::npos) {
    const auto chosen = samples_per_step(name, text.substr(at + 1));
    if (!chosen) return chosen.error();
    per_step = *chosen;
  }
  ReuseMotion motion{text, {}, goals_of(text)};
  for (const CameraPose& pose : poses) {
    motion.before.push_back({pose, motion.before.empty() && begins_at_home(name) ? kRest : per_step});
  }
  return motion;
}

}  // namespace helio::bench
