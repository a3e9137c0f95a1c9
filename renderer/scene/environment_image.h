// Image files as environment maps: what is checked, and what is said of them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "renderer/base/result.h"
#include "renderer/scene/scene_description.h"

namespace helio {

class FileSource;

// As parse_environment() of environment.h; `notices` gets a line for each part, layer or window of an EXR that was
// chosen or left out (decode_image()).
Result<Environment> parse_environment(const std::string& text, const FileSource* source, std::uint64_t max_bytes,
                                      std::vector<Image>& images, std::vector<std::string>& notices);

// invalid_argument: a texel is infinite or NaN; the message has its place and a remedy. prepare_environment_image()
// (environment.h) checks the same.
Status check_environment_image(const Image& image);

}  // namespace helio
