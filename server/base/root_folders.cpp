#include "server/base/root_folders.h"

namespace helio {
namespace fs = std::filesystem;

Result<std::vector<std::string>> open_root_folders(const std::vector<std::string>& directories, const char* option) {
  std::vector<std::string> roots;
  Problems problems;
  for (const std::string& directory : directories) {
    std::error_code error;
    const fs::path root = fs::canonical(directory, error);
    if (error || !fs::is_directory(root, error)) {
      problems.add(option, "'" + directory + "'; allowed: an existing directory");
    } else {
      roots.push_back(root.string());
    }
  }
  if (!problems.empty()) return problems.to_error();
  return roots;
}

bool is_inside(const fs::path& path, const fs::path& root) {
  const fs::path relative = path.lexically_relative(root);
  return !relative.empty() && *relative.begin() != "..";
}

}  // namespace helio
