// Looks over the start of an EXR file before a library may allocate by what it says. Internal to the codec.
#pragma once

#include <cstdint>
#include <span>

#include "renderer/base/result.h"

namespace helio {

// The header's length in bytes when `bytes` begin as a flat scanline file of one part whose attributes all lie within
// the file. OpenEXR 3.1 allocates the sizes that string, preview and vector attributes claim, up to 2 GiB each, before
// it reads them. Otherwise invalid_argument with the reason.
Result<std::size_t> scan_exr_header(std::span<const std::uint8_t> bytes);

}  // namespace helio
