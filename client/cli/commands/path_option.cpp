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

bool is_path_by_name(const TextOption& option) {
  return option.given() && is_path_name(option.text);
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

V3d centre_of(const pb::SceneInfo& scene) {
  const pb::Vec3 &low = scene.bounds_min(), &high = scene.bounds_max();
  return (V3d(low.x(), low.y(), low.z()) + V3d(high.x(), high.y(), high.z())) * 0.5;
}

Result<std::vector<PathView>> path_by_name(const std::string& name, const PathScale& scale, const PathStart& start) {
  const Result<CameraFrame> home = camera_frame(start.camera);
  if (!home) return home.error();
  const auto path = named_path(name, length(start.pivot - home->position), scale);
  if (!path) return path.error();
  return play_named_path(*path, start);
}

}  // namespace helio::cli
