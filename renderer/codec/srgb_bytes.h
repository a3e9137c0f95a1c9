// Linear values to 8-bit sRGB, without a power for each. Internal to the codec.
#pragma once

#include <cstddef>
#include <cstdint>

namespace helio {

// lround(255 encode_srgb(linear)), the same byte for every float.
std::uint8_t srgb_byte(float linear);
// The same of float(factor * values[i]), to out[stride * i].
void srgb_bytes(const float* values, std::size_t count, double factor, std::uint8_t* out, std::size_t stride);

}  // namespace helio
