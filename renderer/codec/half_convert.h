// float -> half, as tiles need it: nothing becomes infinite.
#pragma once

#include <cstddef>

namespace helio {

// Rounds to nearest even. Values beyond +-65504, infinities included, become +-65504; NaN stays NaN. With
// `keep_positive`, a positive value below 2^-24, the smallest half, becomes 2^-24. `out` takes 2 * count bytes, in
// native byte order, at any address.
void convert_to_half(const float* in, std::size_t count, bool keep_positive, char* out);

}  // namespace helio
