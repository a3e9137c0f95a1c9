// Opens a file below a folder, whatever becomes of the folders in between: who can put a link in the place of one
// cannot lead the way out.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <string_view>
#include <utility>

namespace helio {

// Closes on every way out. -1: none.
class FileDescriptor {
 public:
  explicit FileDescriptor(int value = -1) : value_(value) {}
  FileDescriptor(FileDescriptor&& other) noexcept : value_(std::exchange(other.value_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(value_, other.value_);
    return *this;
  }
  ~FileDescriptor() {
    if (value_ >= 0) ::close(value_);
  }

  int get() const { return value_; }
  explicit operator bool() const { return value_ >= 0; }

 private:
  int value_;
};

// `relative`: '/'-separated, without links and ".."; empty or ".": the folder itself. None and errno as of open(2):
// ELOOP or ENOTDIR where a part of it is a link. A component at a time, without openat2(2), which some sandboxes
// refuse.
inline FileDescriptor open_beneath(const std::string& root, std::string_view relative, int flags) {
  constexpr int kFolder = O_PATH | O_DIRECTORY | O_CLOEXEC;
  const bool itself = relative.empty() || relative == ".";
  FileDescriptor at(::open(root.c_str(), itself ? flags | O_CLOEXEC : kFolder));
  while (at && !itself) {
    const std::size_t slash = relative.find('/');
    const std::string part(relative.substr(0, slash));
    if (part.empty() || part == "." || part == "..") {
      errno = EINVAL;
      return FileDescriptor();
    }
    const bool last = slash == std::string_view::npos;
    FileDescriptor next(::openat(at.get(), part.c_str(), last ? flags | O_NOFOLLOW | O_CLOEXEC : kFolder | O_NOFOLLOW));
    if (last) return next;
    at = std::move(next);
    relative.remove_prefix(slash + 1);
  }
  return at;
}

}  // namespace helio
