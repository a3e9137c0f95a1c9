// Files that appear whole or not at all.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

enum class Flush {
  now,
  later,  // whoever needs it on the disk calls flush_files(); after a crash it may be empty or cut until then
};

// A file that comes in pieces: written to a temporary file beside `path`, which takes its place at the end.
class AtomicFile {
 public:
  // not_found, permission_denied, resource_exhausted, internal; so of the others.
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();  // without commit(), `path` is as it was and no temporary file is left

  Status write(std::span<const std::uint8_t> bytes);
  // Flushes it to the disk, renames it and flushes the directory.
  Status commit(Flush flush = Flush::now);

 private:
  AtomicFile(std::string path, std::string temporary, int descriptor)
      : path_(std::move(path)), temporary_(std::move(temporary)), descriptor_(descriptor) {}

  std::string path_, temporary_;  // temporary_: empty once it is gone
  int descriptor_ = -1;
};

// Writes a temporary file beside `path`, flushes it to the disk, renames it and flushes the directory. On failure
// `path` is as it was and no temporary file is left.
Status write_file_atomically(const std::string& path, std::span<const std::uint8_t> bytes);

// As write_file_atomically(); the file is the parts, one behind the other.
Status write_parts_atomically(const std::string& path, std::span<const std::span<const std::uint8_t>> parts,
                              Flush flush = Flush::now);
// Flushes files of one directory, and the directory, to the disk.
Status flush_files(std::span<const std::string> paths);

// not_found, or resource_exhausted when the file is larger than max_bytes.
Result<std::vector<std::uint8_t>> read_whole_file(const std::string& path, std::uint64_t max_bytes);

}  // namespace helio
