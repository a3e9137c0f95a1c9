// Scenes that scenes/generate writes when a bench asks for them: too large, or too many, to be kept as files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "renderer/base/result.h"

namespace helio::bench {

// What `scenes/generate --scene` knows (scenes/generate/study.py).
const std::vector<std::string>& generated_scenes();

// FOLDER/CHECKSUM/NAME.glb, written on first use; the checksum is that of the generator, so that what another version
// of it wrote is not taken. not_found: the generator's files are absent. failed_precondition: it could not be run (it
// needs Python 3.8) or refused the name. permission_denied: the folder cannot be made.
Result<std::filesystem::path> generate_scene(const std::filesystem::path& folder, const std::string& name);

}  // namespace helio::bench
