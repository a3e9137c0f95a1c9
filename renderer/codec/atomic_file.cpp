#include "renderer/codec/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
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

// Closes on every way out.
struct Descriptor {
  int value = -1;
  ~Descriptor() {
    if (value >= 0) ::close(value);
  }
};

bool write_all(int descriptor, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes = bytes.subspan(std::size_t(written));
  }
  return true;
}

// Else the name may be lost with the power. Not every file system can, and the file is in its place already.
void flush_directory_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  const std::string directory = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  const Descriptor opened{::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  if (opened.value >= 0) ::fsync(opened.value);
}

}  // namespace

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  static std::atomic<unsigned> serial{0};
  std::string temporary = path + ".tmp-" + std::to_string(::getpid()) + "-" + std::to_string(++serial);
  const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) return failure(path, "cannot be created");
  return AtomicFile(path, std::move(temporary), descriptor);
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::exchange(other.temporary_, {})),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Status AtomicFile::write(std::span<const std::uint8_t> bytes) {
  if (!write_all(descriptor_, bytes)) return failure(path_, "cannot be written");
  return ok_status();
}

Status AtomicFile::commit(Flush flush) {
  if (flush == Flush::now && ::fsync(descriptor_) != 0) return failure(path_, "cannot be flushed");
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) return failure(path_, "cannot be put in place");
  temporary_.clear();
  if (flush == Flush::now) flush_directory_of(path_);
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
    const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    if (file.value < 0 || ::fsync(file.value) != 0) return failure(path, "cannot be flushed");
  }
  if (!paths.empty()) flush_directory_of(paths.back());
  return ok_status();
}

Result<std::vector<std::uint8_t>> read_whole_file(const std::string& path, std::uint64_t max_bytes) {
  Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
  struct stat info {};
  if (file.value < 0 || ::fstat(file.value, &info) != 0) return failure(path, "cannot be read");
  if (!S_ISREG(info.st_mode)) return Error{ErrorCode::invalid_argument, "is not a regular file", path};
  if (std::uint64_t(info.st_size) > max_bytes) {
    return Error{ErrorCode::resource_exhausted,
                 "has " + std::to_string(info.st_size) + " bytes, at most " + std::to_string(max_bytes) + " allowed",
                 path};
  }
  std::vector<std::uint8_t> bytes(std::size_t(info.st_size));
  std::size_t have = 0;
  while (have < bytes.size()) {
    const ssize_t got = ::read(file.value, bytes.data() + have, bytes.size() - have);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failure(path, "cannot be read");
    if (got == 0) break;  // it has become shorter
    have += std::size_t(got);
  }
  bytes.resize(have);
  return bytes;
}

}  // namespace helio
