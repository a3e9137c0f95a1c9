// float -> half, as tiles need it: nothing becomes infinite.
#pragma once

#include <cstddef>
#include <cstdint>

namespace helio {

// Rounds to nearest even. Values beyond +-65504, infinities included, become +-65504; NaN stays NaN. With
// `keep_positive`, a positive value below 2^-24, the smallest half, becomes 2^-24.
void convert_to_half(const float* in, std::size_t count, bool keep_positive, std::uint16_t* out);

}  // namespace helio
