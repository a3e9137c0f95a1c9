// Where a scene's files are read from: a directory, or memory.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

// Where a scene's bytes come from. Paths are relative, '/'-separated, already percent-decoded; an implementation
// refuses absolute paths, drive letters, ".." components and links that leave its root (ErrorCode::permission_denied).
class FileSource {
 public:
  virtual ~FileSource() = default;
  // The whole file. not_found when absent; resource_exhausted when larger than max_bytes (checked before reading).
  virtual Result<std::vector<std::uint8_t>> read(std::string_view path, std::uint64_t max_bytes) const = 0;
};

// Files under one directory of the local disk; nothing outside it (symlinks resolved) can be read.
std::unique_ptr<FileSource> make_directory_source(std::string directory);

// Files held in memory: an uploaded bundle.
struct NamedFile {
  std::string path;
  std::vector<std::uint8_t> bytes;
};
std::unique_ptr<FileSource> make_memory_source(std::vector<NamedFile> files);

}  // namespace helio
