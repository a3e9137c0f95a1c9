// glTF 2.0 (.gltf, .glb) to SceneDescription.
//
// JSON is read into a gltf::Document of checked plain data, buffers and accessors are checked against the bytes that
// back them, and only then is geometry built. What the Khronos validator calls an error is an error here, as far as it
// says something about the asset; the few rules that are looser stand in tests/unit/scene/malformed_expectations.h.
// Every allocation that a file decides is first asked of a MemoryBudget.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "renderer/scene/memory_budget.h"
#include "renderer/scene/scene_loader.h"

namespace helio {

// `file` is the content of `path`; other files come from `source`. The result may lack cameras and lights: load_scene
// completes it. Errors as load_scene.
Result<SceneDescription> load_gltf(std::span<const std::uint8_t> file, const std::string& path,
                                   const FileSource& source, const SceneLoadOptions& options, MemoryBudget& budget);

}  // namespace helio
