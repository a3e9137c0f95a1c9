// The dark half of a picture, apart: errors relative to the whole picture's mean hide what happens there.
#pragma once

#include "renderer/base/picture_view.h"

namespace helio::bench {

struct DarkHalf {
  double relmse = 0;  // mean((x - r)^2 / (r^2 + 1e-2 mean(r)^2)), mean(r) that of the dark half
  double bias = 0;    // mean(x - r) / mean(r)
};

// Of the pixels whose reference is no brighter (in luminance) than half of them, ties included. NaN where all of these
// are black. Precondition: pictures of the same size, of finite values.
DarkHalf compare_dark_half(const PictureView& picture, const PictureView& reference);

}  // namespace helio::bench
