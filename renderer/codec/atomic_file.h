// Files that appear whole or not at all.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "renderer/base/open_beneath.h"
#include "renderer/base/result.h"

namespace helio {

enum class Flush {
  now,
  later,  // whoever needs it on the disk calls flush_files(); after a crash it may be empty or cut until then
};

// A file that comes in pieces: written to a temporary file beside `path`, which takes its place at the end.
class AtomicFile {
 public:
  // Of a symbolic link its target is written. invalid_argument: `path` is there and is no file (a folder, a device, a
  // pipe). not_found, permission_denied, resource_exhausted, internal; so of the others.
  static Result<AtomicFile> create(const std::string& path);
  // The file of this name in an open folder, whatever becomes of the folder's path, which `path` has for messages. A link
  // of this name is replaced, not followed.
  static Result<AtomicFile> create_in(FileDescriptor folder, const std::string& name, const std::string& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();  // without commit(), `path` is as it was and no temporary file is left

  Status write(std::span<const std::uint8_t> bytes);
  // Flushes it to the disk, renames it and flushes the directory. Without `replace` a file that is there stays, also
  // one that came a moment ago: failed_precondition.
  Status commit(Flush flush = Flush::now, bool replace = true);

 private:
  AtomicFile() = default;
  int folder() const { return folder_ ? folder_.get() : AT_FDCWD; }

  FileDescriptor folder_;         // none: names are paths
  std::string path_;              // for messages
  std::string name_, temporary_;  // temporary_: empty once it is gone
  FileDescriptor file_;
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
// Reads a file that was just opened with O_NONBLOCK (a pipe is refused). Without a descriptor errno says why. path: for
// messages.
Result<std::vector<std::uint8_t>> read_whole_file(const FileDescriptor& file, const std::string& path,
                                                  std::uint64_t max_bytes);

}  // namespace helio
