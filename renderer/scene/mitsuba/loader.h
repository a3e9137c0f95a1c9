// Mitsuba 3 scenes (.xml), and those of 0.5 and 0.6 by the rules that renamed their properties, to SceneDescription.
//
// What a plugin cannot be turned into is refused by name (unimplemented) where the picture would be wrong, and warned
// about where it only differs in sampling or filtering; properties that nothing reads are listed in the LoadReport.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "renderer/scene/description/load_options.h"
#include "renderer/scene/description/memory_budget.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

// By extension, or by content that begins as XML.
bool looks_like_mitsuba(std::span<const std::uint8_t> bytes, const std::string& path);

// As load_gltf.
Result<SceneDescription> load_mitsuba(std::span<const std::uint8_t> file, const std::string& path,
                                      const FileSource& source, const SceneLoadOptions& options, MemoryBudget& budget);

}  // namespace helio
