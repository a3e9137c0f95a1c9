// The one door for scene files: picks the loader by format, enforces the memory limit, completes what a file leaves
// out.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/scene/description/file_source.h"
#include "renderer/scene/description/load_options.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

// Loads `path` from `source`; the format (glTF or Mitsuba XML) follows the content and then the extension.
// Errors: invalid_argument (broken file; `where` is "file/json/pointer", "file@byte" or "file:line"), unimplemented
// (required extension, named), not_found, permission_denied, resource_exhausted.
Result<SceneDescription> load_scene(const FileSource& source, const std::string& path, const SceneLoadOptions& options);

// Relative paths of the other files that a scene file refers to (buffers, images, meshes, includes), for clients that
// upload a bundle. An included file's own references are found by asking again with its bytes.
Result<std::vector<std::string>> referenced_files(std::span<const std::uint8_t> scene_bytes, std::string_view name);

}  // namespace helio
