// Linear values to 8-bit sRGB, without a power for each. Internal to the codec.
#pragma once

#include <cstdint>

namespace helio {

// lround(255 encode_srgb(linear)), the same byte for every float.
std::uint8_t srgb_byte(float linear);

}  // namespace helio
