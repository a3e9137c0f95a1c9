// The dark half of a picture, apart: errors relative to the whole picture's mean hide what happens there.
#pragma once

#include <cstddef>
#include <vector>

#include "renderer/base/picture_view.h"

namespace helio {

// Indices, rising, of the pixels whose reference is no brighter (in luminance) than half of them, ties included.
// Precondition: finite values. Empty only for an empty picture.
std::vector<std::size_t> dark_half_pixels(const PictureView& reference);

struct DarkHalf {
  double relmse = 0;  // mean((x - r)^2 / (r^2 + 1e-2 mean(r)^2)), mean(r) that of the dark half
  double bias = 0;    // mean(x - r) / mean(r)
};

// Errors over the dark half. NaN where all of these pixels are black. Precondition: pictures of the same size, of
// finite values.
DarkHalf compare_dark_half(const PictureView& picture, const PictureView& reference);

}  // namespace helio
