// JPEG files through libjpeg-turbo.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "renderer/base/result.h"

namespace helio {

inline constexpr int kLargestJpegQuality = 100;

// A JPEG file of width * height pixels of 8-bit sRGB, row-major, top row first: baseline, chroma at half the resolution
// each way. quality in [1, 100]. invalid_argument when a side is not in [1, 65500], quality is out of range or rgb has
// another size.
Result<std::vector<std::uint8_t>> encode_jpeg(int width, int height, std::span<const std::uint8_t> rgb, int quality);

}  // namespace helio
