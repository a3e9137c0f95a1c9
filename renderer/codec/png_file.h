// PNG files through OpenImageIO. Internal to the codec.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "renderer/base/result.h"

namespace helio {

// Writes width * height pixels of 8-bit sRGB, row-major, top row first, atomically. `description` goes into the file
// when it is not empty. invalid_argument when a side is not in [1, 65535] or rgb has another size.
Status write_png(const std::string& path, int width, int height, std::span<const std::uint8_t> rgb,
                 const std::string& description);

}  // namespace helio
