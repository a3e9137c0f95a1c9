#include "renderer/codec/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

namespace helio {
namespace {

Error failure(const std::string& path, const char* doing) {
  const int number = errno;
  const ErrorCode code = number == ENOENT   ? ErrorCode::not_found
                         : number == EACCES ? ErrorCode::permission_denied
                         : number == ENOSPC ? ErrorCode::resource_exhausted
                                            : ErrorCode::internal;
  return {code, std::string(doing) + ": " + std::strerror(number), path};
}

bool write_all(int descriptor, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes = bytes.subspan(std::size_t(written));
  }
  return true;
}

FileDescriptor open_directory_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  const std::string directory = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  return FileDescriptor(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
}

// Renames, unless there is a file of the new name: then EEXIST. 0: done.
int rename_to_free_name(int folder, const std::string& from, const std::string& to) {
  if (::renameat2(folder, from.c_str(), folder, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS && errno != EPERM) return -1;
  // The file system, or a sandbox, does not know it; a second name for one file is as good.
  if (::linkat(folder, from.c_str(), folder, to.c_str(), 0) == 0) return ::unlinkat(folder, from.c_str(), 0);
  if (errno == EEXIST) return -1;
  // Nor that: between this look and the renaming a file may come, which is then lost.
  struct stat there {};
  if (::fstatat(folder, to.c_str(), &there, AT_SYMLINK_NOFOLLOW) == 0) return errno = EEXIST, -1;
  return ::renameat(folder, from.c_str(), folder, to.c_str());
}

}  // namespace

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  namespace fs = std::filesystem;
  // Where links lead, whether or not something is there.
  constexpr int kMostLinks = 40;
  std::error_code failed;
  fs::path file = path;
  for (int links = 0; fs::is_symlink(fs::symlink_status(file, failed)); ++links) {
    const fs::path target = fs::read_symlink(file, failed);
    if (failed || links == kMostLinks) return Error{ErrorCode::invalid_argument, "is a link that leads nowhere", path};
    file = file.parent_path() / target;
  }
  return create_in(FileDescriptor(), file.string(), file.string());
}

Result<AtomicFile> AtomicFile::create_in(FileDescriptor folder, const std::string& name, const std::string& path) {
  static std::atomic<unsigned> serial{0};
  AtomicFile file;
  file.folder_ = std::move(folder);
  file.path_ = path;
  file.name_ = name;
  // Renaming would end a device or a pipe.
  struct stat there {};
  if (::fstatat(file.folder(), name.c_str(), &there, AT_SYMLINK_NOFOLLOW) == 0 && !S_ISREG(there.st_mode) &&
      !S_ISLNK(there.st_mode)) {
    return Error{ErrorCode::invalid_argument, "is no regular file, and is not replaced", path};
  }
  // A process of the same number, in another container or before this one, may have left files of such names.
  constexpr int kMostTries = 1000;
  std::string temporary;
  for (int tries = 0; !file.file_; ++tries) {
    temporary = name + ".tmp-" + std::to_string(::getpid()) + "-" + std::to_string(++serial);
    file.file_ =
        FileDescriptor(::openat(file.folder(), temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (!file.file_ && (errno != EEXIST || tries == kMostTries)) return failure(path, "cannot be created");
  }
  file.temporary_ = std::move(temporary);
  return file;
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : folder_(std::move(other.folder_)),
      path_(std::move(other.path_)),
      name_(std::move(other.name_)),
      temporary_(std::exchange(other.temporary_, {})),
      file_(std::move(other.file_)) {}

AtomicFile::~AtomicFile() {
  if (!temporary_.empty()) ::unlinkat(folder(), temporary_.c_str(), 0);
}

Status AtomicFile::write(std::span<const std::uint8_t> bytes) {
  if (!write_all(file_.get(), bytes)) return failure(path_, "cannot be written");
  return ok_status();
}

Status AtomicFile::commit(Flush flush, bool replace) {
  if (flush == Flush::now && ::fsync(file_.get()) != 0) return failure(path_, "cannot be flushed");
  // Opened before the renaming, behind which nothing may fail: the file is in its place then.
  FileDescriptor directory;
  if (flush == Flush::now && !folder_) directory = open_directory_of(path_);
  const int renamed = replace ? ::renameat(folder(), temporary_.c_str(), folder(), name_.c_str())
                              : rename_to_free_name(folder(), temporary_, name_);
  if (renamed != 0 && errno == EEXIST && !replace)
    return Error{ErrorCode::failed_precondition, "is there already, and is not to be replaced", path_};
  if (renamed != 0) return failure(path_, "cannot be put in place");
  temporary_.clear();
  if (flush == Flush::later) return ok_status();
  // Else the name may be lost with the power. Not every file system can.
  if (const FileDescriptor& holds_it = folder_ ? folder_ : directory) ::fsync(holds_it.get());
  return ok_status();
}

Status write_file_atomically(const std::string& path, std::span<const std::uint8_t> bytes) {
  return write_parts_atomically(path, {&bytes, 1});
}

Status write_parts_atomically(const std::string& path, std::span<const std::span<const std::uint8_t>> parts,
                              Flush flush) {
  auto file = AtomicFile::create(path);
  if (!file) return file.error();
  for (const auto& part : parts) {
    if (const Status written = file->write(part); !written) return written;
  }
  return file->commit(flush);
}

Status flush_files(std::span<const std::string> paths) {
  for (const std::string& path : paths) {
    const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (!file || ::fsync(file.get()) != 0) return failure(path, "cannot be flushed");
  }
  if (paths.empty()) return ok_status();
  if (const FileDescriptor directory = open_directory_of(paths.back())) ::fsync(directory.get());
  return ok_status();
}

Result<std::vector<std::uint8_t>> read_whole_file(const std::string& path, std::uint64_t max_bytes) {
  return read_whole_file(FileDescriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)), path, max_bytes);
}

Result<std::vector<std::uint8_t>> read_whole_file(const FileDescriptor& file, const std::string& path,
                                                  std::uint64_t max_bytes) {
  struct stat info {};
  if (!file || ::fstat(file.get(), &info) != 0) return failure(path, "cannot be read");
  if (!S_ISREG(info.st_mode)) return Error{ErrorCode::invalid_argument, "is not a regular file", path};
  if (std::uint64_t(info.st_size) > max_bytes) {
    return Error{ErrorCode::resource_exhausted,
                 "has " + std::to_string(info.st_size) + " bytes, at most " + std::to_string(max_bytes) + " allowed",
                 path};
  }
  std::vector<std::uint8_t> bytes(std::size_t(info.st_size));
  std::size_t have = 0;
  while (have < bytes.size()) {
    const ssize_t got = ::read(file.get(), bytes.data() + have, bytes.size() - have);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failure(path, "cannot be read");
    if (got == 0) break;  // it has become shorter
    have += std::size_t(got);
  }
  bytes.resize(have);
  return bytes;
}

}  // namespace helio
