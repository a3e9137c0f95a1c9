// How much the error of a picture changes from one frame to the next.
#pragma once

#include <cstddef>
#include <vector>

#include "renderer/base/picture_view.h"
#include "renderer/base/result.h"

namespace helio {

// Where each pixel of a picture was seen in the picture before: continuous film coordinates, row-major, top row first.
// Pixel (0, 0) is [0, 1) x [0, 1), its centre (0.5, 0.5). Outside the film, or not finite: it was not seen.
struct PreviousPositions {
  int width = 0, height = 0;
  const float *x = nullptr, *y = nullptr;  // width * height values each
};

struct Flicker {
  double mean = 0;                    // in units of radiance
  double share_without_previous = 0;  // [0, 1): pixels that are left out, for want of a place in the picture before
};

// Flicker along a camera path, motion compensated: with e = picture - reference of each frame, the mean over pixels p
// and channels of |e(p) - e_previous(previous position of p)|, the previous error being that of the pixel that the
// position lies in. A constant error does not flicker, however large it is.
//
// invalid_argument as for error_metrics.h, for both frames, and when sizes differ from frame to frame or from the
// positions'; failed_precondition when no pixel was seen before.
struct FlickerFrame {
  PictureView picture, reference;
};
Result<Flicker> flicker(const FlickerFrame& previous, const FlickerFrame& frame, const PreviousPositions& positions);

// The same of error images that exist, or of errors of another kind; with `pixels`, of these alone, by index.
Result<Flicker> flicker(const PictureView& previous_error, const PictureView& error,
                        const PreviousPositions& positions, const std::vector<std::size_t>* pixels = nullptr);

}  // namespace helio
