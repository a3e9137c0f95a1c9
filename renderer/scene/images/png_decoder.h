// Encoded PNG to texels, by libspng: it checks every CRC and length, and says nothing on stderr.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "renderer/base/result.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

// Called with Image::bytes() before these are allocated; an error ends decoding.
using AdmitImage = std::function<Status(int width, int height, std::uint64_t bytes)>;

// Samples as stored: 8 or 16 bits, one to four channels, no colour conversion. Samples of 1, 2 and 4 bits are scaled to
// 8, a palette becomes RGB, and a transparent colour (tRNS) an alpha channel. Chunks behind the last IDAT are not read,
// and what is broken in an ancillary chunk is left out.
//
// Errors, `where` = name: invalid_argument (broken or cut off), resource_exhausted (ancillary chunks of more than 64
// MiB), and those of `admit`. Throws std::bad_alloc.
Result<Image> decode_png(std::span<const std::uint8_t> png, const std::string& name, const AdmitImage& admit);

}  // namespace helio
