// glTF 2.0 (.gltf, .glb) to SceneDescription.
//
// JSON is read into a gltf::Document of checked plain data, buffers and accessors are checked against the bytes that
// back them, and only then is geometry built. What the Khronos validator calls an error in its own test files is an
// error of a strict load here. Rules that real exporters break without harm are slips (description/load_diagnostics.h): warnings of
// other loads. Every allocation that a file decides is first asked of a MemoryBudget.
//
// The JSON is read directly rather than through tinygltf: that library gives a wrong type or a missing property its
// default, keeps indices unchecked and copies every buffer, so that each check would have to be made on the JSON
// anyway.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "renderer/scene/description/load_options.h"
#include "renderer/scene/description/memory_budget.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

// `file` is the content of `path`; other files come from `source`. The result may lack cameras and lights: load_scene
// completes it. Errors as load_scene.
Result<SceneDescription> load_gltf(std::span<const std::uint8_t> file, const std::string& path,
                                   const FileSource& source, const SceneLoadOptions& options, MemoryBudget& budget);

// referenced_files() of a glTF file.
Result<std::vector<std::string>> gltf_referenced_files(std::span<const std::uint8_t> gltf_bytes,
                                                       std::string_view name);

}  // namespace helio
