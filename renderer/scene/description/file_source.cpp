#include "renderer/scene/description/file_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>

#include "renderer/base/open_beneath.h"

namespace helio {

namespace {

namespace fs = std::filesystem;

// Refuses whatever could name something outside of the source.
Status check_path(std::string_view path) {
  const std::string where(path);
  if (path.empty()) return Error{ErrorCode::invalid_argument, "the path is empty", where};
  if (path.find('\0') != std::string_view::npos)
    return Error{ErrorCode::invalid_argument, "the path holds a zero byte", where};
  const bool drive = path.size() >= 2 && path[1] == ':' && ((path[0] | 0x20) >= 'a' && (path[0] | 0x20) <= 'z');
  if (path.front() == '/' || path.front() == '\\' || drive)
    return Error{ErrorCode::permission_denied, "absolute paths are not read, only files beside the scene", where};
  std::string_view rest = path;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find_first_of("/\\"), rest.size());
    if (rest.substr(0, end) == "..")
      return Error{ErrorCode::permission_denied, "\"..\" would leave the scene's folder", where};
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return ok_status();
}

Error too_large(std::uint64_t size, std::uint64_t max_bytes, const std::string& where) {
  return {ErrorCode::resource_exhausted,
          "the file has " + std::to_string(size) + " bytes, more than the " + std::to_string(max_bytes) +
              " that may be read (limit max_memory_bytes)",
          where};
}

// Bytes that could be read.
std::uint64_t read_all(int file, std::vector<std::uint8_t>& bytes) {
  std::size_t have = 0;
  while (have < bytes.size()) {
    const ssize_t got = ::read(file, bytes.data() + have, bytes.size() - have);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    have += std::size_t(got);
  }
  return have;
}

class DirectorySource final : public FileSource {
 public:
  explicit DirectorySource(std::string directory) : directory_(directory.empty() ? "." : std::move(directory)) {}

  Result<std::vector<std::uint8_t>> read(std::string_view path, std::uint64_t max_bytes) const override {
    if (Status s = check_path(path); !s.ok()) return s.error();
    const std::string where(path);
    const Error missing{ErrorCode::not_found, "there is no such file", where};
    std::error_code error;
    const fs::path root = fs::canonical(directory_, error);
    if (error) return missing;
    const fs::path full = fs::canonical(root / fs::path(where), error);
    if (error) return missing;
    const auto [in_root, in_full] = std::mismatch(root.begin(), root.end(), full.begin(), full.end());
    if (in_root != root.end())
      return Error{ErrorCode::permission_denied, "the file is a link that leaves the scene's folder", where};
    // Anything else (a pipe, a device) could block for ever.
    if (!fs::is_regular_file(full, error)) return Error{ErrorCode::not_found, "is not a regular file", where};
    // The way has no links, and gets none between here and the file.
    const FileDescriptor file =
        open_beneath(root.string(), full.lexically_relative(root).generic_string(), O_RDONLY | O_NONBLOCK);
    struct stat info {};
    if (!file || ::fstat(file.get(), &info) != 0)
      return Error{ErrorCode::permission_denied, std::string("cannot be opened: ") + std::strerror(errno), where};
    if (!S_ISREG(info.st_mode)) return Error{ErrorCode::not_found, "is not a regular file", where};
    const auto size = std::uint64_t(info.st_size);
    if (size > max_bytes) return too_large(size, max_bytes, where);
    std::vector<std::uint8_t> bytes(size);
    const std::uint64_t have = read_all(file.get(), bytes);
    if (have != size)
      return Error{ErrorCode::unavailable,
                   "only " + std::to_string(have) + " of " + std::to_string(size) + " bytes could be read", where};
    return bytes;
  }

 private:
  std::string directory_;
};

class MemorySource final : public FileSource {
 public:
  explicit MemorySource(std::vector<NamedFile> files) {
    for (NamedFile& file : files) files_[normalized(file.path)] = std::move(file.bytes);
  }

  Result<std::vector<std::uint8_t>> read(std::string_view path, std::uint64_t max_bytes) const override {
    if (Status s = check_path(path); !s.ok()) return s.error();
    const auto found = files_.find(normalized(path));
    if (found == files_.end()) return Error{ErrorCode::not_found, "the bundle has no such file", std::string(path)};
    if (found->second.size() > max_bytes) return too_large(found->second.size(), max_bytes, std::string(path));
    return found->second;
  }

 private:
  // "./a//b" and "a/b" are the same file.
  static std::string normalized(std::string_view path) { return fs::path(path).lexically_normal().generic_string(); }

  std::map<std::string, std::vector<std::uint8_t>> files_;
};

}  // namespace

std::unique_ptr<FileSource> make_directory_source(std::string directory) {
  return std::make_unique<DirectorySource>(std::move(directory));
}

std::unique_ptr<FileSource> make_memory_source(std::vector<NamedFile> files) {
  return std::make_unique<MemorySource>(std::move(files));
}

}  // namespace helio
