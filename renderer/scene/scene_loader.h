// The one door for scene files: picks the loader by format, enforces the memory limit, completes what a file leaves
// out.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/memory_ledger.h"
#include "renderer/base/result.h"
#include "renderer/scene/scene_description.h"

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

struct SceneLoadOptions {
  double time_s = 0;                        // the animation is evaluated at this time
  // Name of the animation (clip) to play, or its number written in decimal; empty: the first that moves anything.
  std::string animation;
  // Refuses files that break a rule of their format even where their meaning is beyond doubt (scenes/README.md).
  bool strict = false;
  std::uint64_t max_memory_bytes = 8ull << 30;  // everything that loading may hold at once, decoded images included
  MemoryLedger* ledger = nullptr;  // what loading holds is taken from it besides, and left in it; null: none
  // "FILE.exr" (read through environment_source) or "R,G,B"; empty: what the scene says. See environment.h.
  std::string environment;
  const FileSource* environment_source = nullptr;
};

// Loads `path` from `source`; the format (glTF or Mitsuba XML) follows the content and then the
// extension.
// Errors: invalid_argument (broken file; `where` is "file/json/pointer",
// "file@byte" or "file:line"), unimplemented (required
// extension, named), not_found, permission_denied, resource_exhausted.
Result<SceneDescription> load_scene(const FileSource& source, const std::string& path, const SceneLoadOptions& options);

// Relative paths of the other files that a scene file refers to (buffers, images, meshes, includes), for clients that
// upload a bundle. An included file's own references are found by asking again with its bytes.
Result<std::vector<std::string>> referenced_files(std::span<const std::uint8_t> scene_bytes, std::string_view name);

}  // namespace helio
