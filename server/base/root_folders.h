// Folders that the daemon may read from, or write to, and nothing beside them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

// Absolute, with links resolved once, here. invalid_argument names each that is no directory, as a value of `option`.
Result<std::vector<std::string>> open_root_folders(const std::vector<std::string>& directories, const char* option);

// Whether a path is the root or lies in it. Both are absolute, without links and "..".
bool is_inside(const std::filesystem::path& path, const std::filesystem::path& root);

}  // namespace helio
