#include "server/state/state_folder.h"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "renderer/codec/atomic_file.h"

namespace helio {
namespace {

namespace fs = std::filesystem;

// What a database page needs at least: a full disk may still have room for a few bytes.
constexpr std::size_t kProbeBytes = 64 << 10;

Error unusable(const std::string& path, const std::string& why) {
  return {ErrorCode::unavailable, fmt::format("the state folder '{}' {}", path, why), {}};
}

std::string system_text() {
  return std::strerror(errno);
}

// With what is missing above it; those folders are for everyone to read, as mkdir -p makes them.
Status make_folder(const std::string& path) {
  std::error_code failed;
  fs::create_directories(fs::path(path).parent_path(), failed);
  if (failed) return unusable(path, "cannot be made: " + failed.message());
  if (::mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) return unusable(path, "cannot be made: " + system_text());
  if (!fs::is_directory(path, failed)) return unusable(path, "is not a folder");
  return ok_status();
}

std::string read_process(int lock) {
  char text[32] = {};
  const ssize_t size = ::pread(lock, text, sizeof(text) - 1, 0);
  std::string process(text, size > 0 ? std::size_t(size) : 0);
  process.erase(process.find_last_not_of(" \n") + 1);
  const bool digits = !process.empty() && process.find_first_not_of("0123456789") == std::string::npos;
  return digits ? "process " + process : "a process that is not named in its lock file";
}

struct Descriptor {
  int value = -1;
  ~Descriptor() {
    if (value >= 0) ::close(value);
  }
};

}  // namespace

Result<std::string> default_state_folder() {
  const char* state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && state[0] == '/') return std::string(state) + "/heliograph";
  const char* home = std::getenv("HOME");
  if (home != nullptr && home[0] == '/') return std::string(home) + "/.local/state/heliograph";
  return Error{ErrorCode::failed_precondition,
               "neither $XDG_STATE_HOME nor $HOME names a folder by its absolute path; name the state folder", "state"};
}

Result<StateFolder> StateFolder::open(const std::string& directory) {
  std::error_code failed;
  std::string path = fs::absolute(directory, failed).lexically_normal().string();
  if (directory.empty() || failed) return unusable(directory, "is not the name of a folder");
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  if (const Status made = make_folder(path); !made.ok()) return made.error();

  Descriptor lock{::open((path + "/lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)};
  if (lock.value < 0) return unusable(path, "cannot be written: " + system_text());
  if (::flock(lock.value, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return unusable(path, "cannot be locked: " + system_text());
    return Error{ErrorCode::failed_precondition,
                 fmt::format("the state folder '{}' is in use by {}; a daemon needs a state folder of its own", path,
                             read_process(lock.value)),
                 {}};
  }
  const std::string process = std::to_string(::getpid()) + "\n";
  if (::ftruncate(lock.value, 0) != 0 ||
      ::pwrite(lock.value, process.data(), process.size(), 0) != ssize_t(process.size())) {
    return unusable(path, "cannot be written: " + system_text());
  }
  for (const char* folder : {"/checkpoints", "/scenes", "/sessions", "/results"}) {
    if (::mkdir((path + folder).c_str(), 0700) == 0 || errno == EEXIST) continue;
    return unusable(path, "cannot be written: " + system_text());
  }
  // Of a daemon that was killed while it wrote the file below.
  for (fs::directory_iterator entry(path, failed), end; !failed && entry != end; entry.increment(failed)) {
    std::error_code ignored;
    if (entry->path().filename().string().starts_with("write-test")) fs::remove(entry->path(), ignored);
  }
  const std::string probe = path + "/write-test";
  const std::vector<std::uint8_t> bytes(kProbeBytes, 0x5a);
  if (const Status written = write_file_atomically(probe, bytes); !written.ok()) {
    return unusable(path, "cannot be written (a file " + written.error().message + ")");
  }
  if (::unlink(probe.c_str()) != 0) return unusable(path, "cannot be written: " + system_text());
  return StateFolder(std::move(path), std::exchange(lock.value, -1));
}

StateFolder::StateFolder(StateFolder&& other) noexcept
    : path_(std::move(other.path_)), lock_(std::exchange(other.lock_, -1)) {}

StateFolder& StateFolder::operator=(StateFolder&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(lock_, other.lock_);
  return *this;
}

StateFolder::~StateFolder() {
  if (lock_ >= 0) ::close(lock_);
}

}  // namespace helio
