// Radiance with a common exponent, for the page's script.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/base/picture_view.h"

namespace helio::report {

// Four planes of width * height bytes: mantissas of R, G and B, and the exponent e they share; a channel is
// mantissa * 2^(e - 136), within 2^-8 of the pixel's largest one. e = 0: black. What is negative or not a number counts
// as 0, infinity as the largest. Each row of a plane is the differences, modulo 256, of neighbours: the first is from
// 0.
std::vector<std::uint8_t> rgbe_planes(const PictureView& picture);

}  // namespace helio::report
