// Files that appear whole or not at all.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

// Writes a temporary file beside `path`, flushes it to the disk, renames it and flushes the directory. On failure `path`
// is as it was and no temporary file is left.
Status write_file_atomically(const std::string& path, std::span<const std::uint8_t> bytes);

// not_found, or resource_exhausted when the file is larger than max_bytes.
Result<std::vector<std::uint8_t>> read_whole_file(const std::string& path, std::uint64_t max_bytes);

}  // namespace helio
