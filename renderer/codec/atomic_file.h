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

enum class Flush {
  now,
  later,  // whoever needs it on the disk calls flush_files(); after a crash it may be empty or cut until then
};
// As write_file_atomically(); the file is the parts, one behind the other.
Status write_parts_atomically(const std::string& path, std::span<const std::span<const std::uint8_t>> parts,
                              Flush flush = Flush::now);
// Flushes files of one directory, and the directory, to the disk.
Status flush_files(std::span<const std::string> paths);

// not_found, or resource_exhausted when the file is larger than max_bytes.
Result<std::vector<std::uint8_t>> read_whole_file(const std::string& path, std::uint64_t max_bytes);

}  // namespace helio
