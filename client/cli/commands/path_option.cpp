#include "client/cli/commands/path_option.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

constexpr std::uint64_t kMaxPathBytes = 64 << 20;

}  // namespace

void add_path_option(CLI::App& app, TextOption& option, const std::string& help) {
  add_text(app, option, "--path", "NAME|PATH.json", help);
}

bool is_path_by_name(const TextOption& option) {
  return option.given() && is_path_name(option.text);
}

void add_path_input(const TextOption& option, OutputCheck& outputs) {
  if (!is_path_by_name(option)) outputs.add_input(option.text, "the camera path");
}

std::string read_path_file(const TextOption& option, OptionReader& reader) {
  if (!option.given() || is_path_name(option.text)) return {};
  std::error_code ignored;
  if (std::filesystem::is_directory(option.text, ignored)) {
    reader.problem(option, "'" + option.text + "' is a folder, not a file");
    return {};
  }
  std::ifstream file(option.text, std::ios::binary | std::ios::ate);
  const auto bytes = file ? static_cast<std::int64_t>(file.tellg()) : -1;
  if (bytes < 0) {
    reader.problem(option, fmt::format("'{}' cannot be opened, and is none of {}", option.text, path_names()));
    return {};
  }
  if (bytes > std::int64_t(kMaxPathBytes)) {
    reader.problem(option, fmt::format("'{}' has more than {} bytes", option.text, kMaxPathBytes));
    return {};
  }
  std::string text(std::max<std::int64_t>(bytes, 0), '\0');
  file.seekg(0);
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  return text;
}

PathScale read_path_scale(const TextOption& path_option, const TextOption& steps_option, const TextOption& step_option,
                          OptionReader& reader) {
  PathScale scale;
  scale.step = reader.number(step_option, {-360, 360});
  if (const auto steps = reader.integer(steps_option, 1, 100000)) scale.steps = static_cast<int>(*steps);
  if (!is_path_by_name(path_option)) {
    if (step_option.given()) reader.problem(step_option, "is only valid with a --path by name");
    return scale;
  }
  // With any distance: what is wrong with the scale is told before the scene is loaded.
  const auto path = named_path(path_option.text, 1, scale);
  if (!path) reader.problem(path_option, path.error().to_string());
  return scale;
}

V3d centre_of(const pb::SceneInfo& scene) {
  const pb::Vec3 &low = scene.bounds_min(), &high = scene.bounds_max();
  return (V3d(low.x(), low.y(), low.z()) + V3d(high.x(), high.y(), high.z())) * 0.5;
}

Result<std::vector<PathView>> read_path_views(const TextOption& option, const std::string& text, const PathScale& scale,
                                              const PathStart& start) {
  if (!is_path_by_name(option)) return parse_camera_path(text, option.text, start);
  const Result<CameraFrame> home = camera_frame(start.camera);
  if (!home) return home.error();
  const auto path = named_path(option.text, length(start.pivot - home->position), scale);
  if (!path) return path.error();
  return play_named_path(*path, start);
}

}  // namespace helio::cli
