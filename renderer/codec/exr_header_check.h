// Looks over the start of an EXR file before OpenEXR may allocate by what it says. Internal to the codec.
#pragma once

#include <cstdint>
#include <span>

#include "renderer/base/result.h"

namespace helio {

// ok: `bytes` begin as a flat scanline file of one part whose attributes all lie within the file. OpenEXR 3.1 allocates
// the sizes that string, preview and vector attributes claim, up to 2 GiB each, before it reads them; OpenEXRCore looks
// first. Otherwise invalid_argument with the reason.
Status check_exr_header(std::span<const std::uint8_t> bytes);

}  // namespace helio
