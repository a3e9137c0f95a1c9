// PNG files and zlib streams in memory.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace helio::report {

// RFC 1950. Precondition: there is memory for it.
std::vector<std::uint8_t> zlib_bytes(std::span<const std::uint8_t> bytes);

// width * height pixels of 8-bit sRGB, row-major, top row first. Preconditions: both sides in [1, 65535], 3 bytes a
// pixel.
std::vector<std::uint8_t> png_of_rgb(int width, int height, std::span<const std::uint8_t> rgb);

// A PNG of one byte a pixel, an index into the palette of 8-bit sRGB colours.
using Palette = std::array<std::array<std::uint8_t, 3>, 256>;
std::vector<std::uint8_t> png_of_indices(int width, int height, std::span<const std::uint8_t> indices,
                                         const Palette& palette);

}  // namespace helio::report
