#include "server/scenes/scene_roots.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "server/base/root_folders.h"

namespace helio {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMaxPath = 4096;
constexpr std::size_t kMaxScanned = 100000;       // entries of a folder that a list looks at
constexpr std::size_t kMaxListedBytes = 1 << 20;  // of paths

bool has_control(std::string_view text) {
  return std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 127; });
}

bool is_below(const fs::path& path, const fs::path& root) {
  return path.lexically_relative(root) != "." && is_inside(path, root);
}

// Nothing: neither a scene nor an environment map.
std::optional<bool> is_environment(const std::string& path) {
  std::string ending = fs::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".gltf" || ending == ".glb" || ending == ".xml") return false;
  if (ending == ".exr" || ending == ".hdr") return true;
  return std::nullopt;
}

}  // namespace

Result<SceneRoots> SceneRoots::open(const std::vector<std::string>& directories) {
  auto folders = open_root_folders(directories, "scene-root");
  if (!folders) return folders.error();
  SceneRoots roots;
  roots.roots_ = std::move(*folders);
  return roots;
}

Result<SceneRoots::Location> SceneRoots::find(std::string_view path, const std::string& where) const {
  if (path.empty() || path.size() > kMaxPath || has_control(path)) {
    return Error{
        ErrorCode::invalid_argument,
        "a path of " + std::to_string(path.size()) + " bytes; allowed: 1 to 4096 bytes without control characters",
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

Result<SceneRoots::List> SceneRoots::list(std::string_view folder, const std::string& where) const {
  if (folder.size() > kMaxPath || has_control(folder)) {
    return Error{
        ErrorCode::invalid_argument,
        "a path of " + std::to_string(folder.size()) + " bytes; allowed: at most 4096 bytes without control characters",
        where};
  }
  const std::string shown = "'" + std::string(folder.substr(0, 256)) + "'";
  if (roots_.empty()) {
    return Error{ErrorCode::permission_denied, "this daemon serves no paths (no --scene-root was given)", where};
  }
  std::map<std::string, Entry> found;  // a path of several roots is that of the first
  bool inside = false, there = false;
  std::size_t scanned = 0;
  for (const std::string& root : roots_) {
    std::error_code error;
    const fs::path real =
        folder.empty() ? fs::path(root) : fs::weakly_canonical(fs::path(root) / fs::path(folder), error);
    if (error || !is_inside(real, root)) continue;
    inside = true;
    if (!fs::is_directory(real, error)) continue;
    there = true;
    for (auto entry = fs::directory_iterator(real, fs::directory_options::skip_permission_denied, error);
         !error && entry != fs::directory_iterator() && scanned < kMaxScanned; entry.increment(error), ++scanned) {
      Entry listed{entry->path().lexically_relative(root).generic_string()};
      if (entry->path().filename().string().starts_with('.') || found.contains(listed.path)) continue;
      if (has_control(listed.path)) continue;
      const std::optional<bool> environment = is_environment(listed.path);
      std::error_code unreadable;
      listed.folder = entry->is_directory(unreadable);
      if (unreadable || !(listed.folder || environment)) continue;
      // What is no link lies below the root, since its folder does.
      if (entry->is_symlink(unreadable) && !is_below(fs::weakly_canonical(entry->path(), unreadable), root)) continue;
      if (!listed.folder) {
        listed.environment = *environment;
        listed.bytes = entry->is_regular_file(unreadable) ? entry->file_size(unreadable) : 0;
        if (unreadable || !entry->is_regular_file(unreadable)) continue;
      }
      found.emplace(listed.path, listed);
    }
  }
  if (!inside) return Error{ErrorCode::permission_denied, shown + " is outside the scene roots", where};
  if (!there) return Error{ErrorCode::not_found, "there is no folder " + shown + " below the scene roots", where};
  List list{{}, found.size()};
  std::size_t bytes = 0;
  for (const bool folders : {true, false}) {
    for (const auto& [path, entry] : found) {
      if (entry.folder != folders || list.entries.size() == kMaxListed || bytes > kMaxListedBytes) continue;
      bytes += entry.path.size();
      list.entries.push_back(entry);
    }
  }
  return list;
}

}  // namespace helio
