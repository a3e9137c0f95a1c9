#include "server/scenes/scene_roots.h"

#include <filesystem>

namespace helio {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMaxPath = 4096;

bool is_below(const fs::path& path, const fs::path& root) {
  const fs::path relative = path.lexically_relative(root);
  return !relative.empty() && *relative.begin() != ".." && relative != ".";
}

}  // namespace

Result<SceneRoots> SceneRoots::open(const std::vector<std::string>& directories) {
  SceneRoots roots;
  Problems problems;
  for (const std::string& directory : directories) {
    std::error_code error;
    const fs::path root = fs::canonical(directory, error);
    if (error || !fs::is_directory(root, error)) {
      problems.add("scene-root", "'" + directory + "'; allowed: an existing directory");
    } else {
      roots.roots_.push_back(root.string());
    }
  }
  if (!problems.empty()) return problems.to_error();
  return roots;
}

Result<SceneRoots::Location> SceneRoots::find(std::string_view path, const std::string& where) const {
  if (path.empty() || path.size() > kMaxPath || path.find('\0') != std::string_view::npos) {
    return Error{ErrorCode::invalid_argument,
                 "a path of " + std::to_string(path.size()) + " bytes; allowed: 1 to 4096 bytes without zero bytes",
                 where};
  }
  const std::string shown = "'" + std::string(path.substr(0, 256)) + "'";
  if (roots_.empty()) {
    return Error{ErrorCode::permission_denied, shown + "; this daemon serves no paths (no --scene-root was given)",
                 where};
  }
  bool inside = false;
  for (const std::string& root : roots_) {
    std::error_code error;
    const fs::path real =
        fs::weakly_canonical(fs::path(root) / fs::path(path), error);  // an absolute path replaces root
    if (error || !is_below(real, root)) continue;
    inside = true;
    if (fs::is_regular_file(real, error)) return Location{root, real.lexically_relative(root).generic_string()};
  }
  if (!inside) return Error{ErrorCode::permission_denied, shown + " is outside the scene roots", where};
  return Error{ErrorCode::not_found, "there is no file " + shown + " below the scene roots", where};
}

}  // namespace helio
