#include "client/cli/commands/output_check.h"

#include <sys/stat.h>

#include <cctype>
#include <filesystem>
#include <optional>
#include <system_error>

namespace helio::cli {

namespace fs = std::filesystem;

void OutputCheck::add_input(const std::string& path, const std::string& what) {
  struct stat file {};
  if (!path.empty() && ::stat(path.c_str(), &file) == 0) inputs_.emplace(FileId(file.st_dev, file.st_ino), what);
}

void OutputCheck::add_inputs(const SceneChoice& choice) {
  // With --scene-path these are names of the daemon's, whose files may be ours as well.
  add_input(choice.file, "the scene");
  add_input(choice.environment, "the environment map");
  if (choice.on_server || !choice.local) return;
  for (const LocalSceneFile& file : choice.local->files) add_input(file.path, "a file of the scene");
}

void check_exr_name(const std::string& option, const std::string& path, const std::string& hint, Problems& problems) {
  std::string suffix = fs::path(path).extension().string();
  for (char& c : suffix) c = char(std::tolower(static_cast<unsigned char>(c)));
  for (const char* other : {".png", ".jpg", ".jpeg", ".hdr", ".pfm", ".tif", ".tiff"}) {
    if (suffix == other)
      problems.add(option, "'" + path + "' is written as OpenEXR; allowed: a name that ends in .exr" + hint);
  }
}

void OutputCheck::check(const FileNames& names, Problems& problems) {
  check("--output", names.exr, problems);
  check_exr_name("--output", names.exr, " (--png writes a PNG)", problems);
  if (!names.png.empty()) check("--png", names.png, problems);
  for (const HeatMap map : names.heat_maps) check("--heatmap", heat_map_file(names.heatmap, map), problems);
}

void OutputCheck::check(const std::string& option, const std::string& path, Problems& problems) {
  struct stat file {};
  if (::stat(path.c_str(), &file) == 0) {
    if (const auto input = inputs_.find(FileId(file.st_dev, file.st_ino)); input != inputs_.end()) {
      problems.add(option, "'" + path + "' is " + input->second + ", which must not be overwritten");
      return;
    }
  }
  const auto [other, first] = outputs_.emplace(place_of(path), option);
  if (!first)
    problems.add(option, "'" + path + "' is written by " + other->second + " too; each needs a file of its own");
}

// Files are replaced by name: a link is overwritten itself, only the links of its folder are followed.
std::string OutputCheck::place_of(const std::string& path) {
  const fs::path file(path);
  const std::string folder = file.has_parent_path() ? file.parent_path().string() : ".";
  auto known = folders_.find(folder);
  if (known == folders_.end()) {
    std::error_code problem;
    const fs::path real = fs::canonical(folder, problem);
    known = folders_.emplace(folder, problem ? folder : real.string()).first;
  }
  return known->second + "/" + file.filename().string();
}

}  // namespace helio::cli
