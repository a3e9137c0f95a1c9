// Structural dissimilarity.
#pragma once

#include "renderer/base/picture_view.h"
#include "renderer/base/result.h"

namespace helio {

struct Dssim {
  double ssim = 1;   // mean over pixels, [-1, 1]
  double dssim = 0;  // 1 / SSIM - 1, 0 for equal pictures; +infinity when SSIM is not positive
};

// SSIM as in Wang et al. 2004 ("Image quality assessment: from error visibility to structural similarity", eq. 13):
// Gaussian window of 11x11 with sigma 1.5, K1 = 0.01, K2 = 0.03, dynamic range 1, on the sRGB-encoded luminance of
// exposure * picture, clamped to [0, 1]. Windows are cut at the border and renormalised. DSSIM as in Soares 2020,
// section 4.1.2; that thesis measured with a multi-scale tool in Lab, so its figures are comparable in order only.
// invalid_argument as for error_metrics.h, and when exposure is not positive.
Result<Dssim> dssim(const PictureView& picture, const PictureView& reference, double exposure = 1);

}  // namespace helio
