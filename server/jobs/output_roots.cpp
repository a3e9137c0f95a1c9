#include "server/jobs/output_roots.h"

#include <fcntl.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "renderer/codec/atomic_file.h"
#include "server/base/root_folders.h"

namespace helio {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMaxPath = 4096;
constexpr std::size_t kMaxName = 200;  // 255 of file systems, less what the temporary file beside it needs
constexpr const char kView[] = "{view}";

}  // namespace

Result<OutputRoots> OutputRoots::open(const std::vector<std::string>& directories) {
  auto folders = open_root_folders(directories, "output-root");
  if (!folders) return folders.error();
  OutputRoots roots;
  roots.roots_ = std::move(*folders);
  return roots;
}

void OutputRoots::check(const std::string& path, std::uint32_t views, const std::string& where, Problems& problems) {
  const auto control = [](unsigned char c) { return c < ' ' || c == 127; };
  if (path.empty() || path.size() > kMaxPath || std::any_of(path.begin(), path.end(), control)) {
    return problems.add(where, fmt::format("a path of {} bytes; allowed: 1 to {} bytes without control characters",
                                           path.size(), kMaxPath));
  }
  const std::string name = fs::path(path).filename().string();
  if (!name.ends_with(".exr") || name == ".exr")
    problems.add(where, "'" + path + "'; allowed: the name of a file that ends in .exr");
  if (name.size() > kMaxName)
    problems.add(where, fmt::format("the name of a file of {} bytes; allowed: at most {}", name.size(), kMaxName));
  const bool numbered = name.find(kView) != std::string::npos;
  if (views > 1 && !numbered) {
    problems.add(where, fmt::format("'{}' for {} views; allowed: a name with {}, which becomes a view's index", path,
                                    views, kView));
  }
}

Result<std::string> OutputRoots::file_of(const std::string& path, std::uint32_t view, const std::string& where) const {
  const fs::path given(path);
  std::string name = given.filename().string();
  if (const auto at = name.find(kView); at != std::string::npos)
    name.replace(at, sizeof kView - 1, fmt::format("{:04}", view));
  if (roots_.empty()) {
    return Error{ErrorCode::permission_denied,
                 "'" + path + "'; this daemon writes no files (no --output-root was given)", where};
  }
  // A relative path is below the first root.
  std::error_code error;
  const fs::path folder = fs::weakly_canonical(fs::path(roots_.front()) / given.parent_path(), error);
  const bool inside = !error && std::any_of(roots_.begin(), roots_.end(), [&](const std::string& root) {
    return is_inside(folder, root);
  });
  if (!inside) return Error{ErrorCode::permission_denied, "'" + path + "' is outside the output roots", where};
  if (!fs::is_directory(folder, error))
    return Error{ErrorCode::not_found, "'" + path + "': there is no folder '" + folder.string() + "'", where};
  return (folder / name).string();
}

const std::string* OutputRoots::root_of(const std::string& path) const {
  const auto found =
      std::find_if(roots_.begin(), roots_.end(), [&](const auto& root) { return is_inside(path, root); });
  return found == roots_.end() ? nullptr : &*found;
}

Status OutputRoots::write(const std::string& file, std::span<const std::uint8_t> bytes, bool replace) const {
  const fs::path folder = fs::path(file).parent_path();
  const std::string* const root = root_of(folder.string());
  if (!root) return Error{ErrorCode::permission_denied, "is outside the output roots", file};
  const std::string relative = folder.lexically_relative(*root).generic_string();
  FileDescriptor opened = open_beneath(*root, relative, O_RDONLY | O_DIRECTORY);
  if (!opened && errno == EACCES)
    opened = open_beneath(*root, relative, O_PATH | O_DIRECTORY);  // enough to write there
  if (!opened) {
    const int number = errno;
    const ErrorCode code = number == ENOENT ? ErrorCode::not_found : ErrorCode::permission_denied;
    return Error{code, std::string("its folder cannot be opened: ") + std::strerror(number), file};
  }
  auto written = AtomicFile::create_in(std::move(opened), fs::path(file).filename().string(), file);
  if (!written) return written.error();
  if (const Status done = written->write(bytes); !done.ok()) return done;
  return written->commit(Flush::now, replace);
}

FileDescriptor OutputRoots::open(const std::string& file) const {
  constexpr int kFlags = O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC;
  const std::string* const root = root_of(file);
  if (root) return open_beneath(*root, fs::path(file).lexically_relative(*root).generic_string(), kFlags);
  return FileDescriptor(::open(file.c_str(), kFlags));  // a root that was taken away since, or the state folder
}

}  // namespace helio
