// Error against the picture that a reference converges to, from a reference rendered twice.
#pragma once

#include "renderer/base/picture_view.h"
#include "renderer/base/result.h"
#include "renderer/metrics/error_metrics.h"

namespace helio {

struct UnbiasedError {
  double value = 0;           // may be negative: where the error is below what the reference resolves
  double standard_error = 0;  // of `value`, from the noise of the reference alone
};

// A reference's own noise adds its variance to every squared error against it. With two independent renderings a and
// b of the reference (other seeds, as many samples each) the product (x - a)(x - b) has the expectation (x - t)^2, t
// the value that both converge to: the noise of one is independent of that of the other. x must be independent of both.
//
// mse: mean of (x - a)(x - b) over pixels and channels, unbiased.
// relmse: mean of (x - a)(x - b) / (r^2 + epsilon), r = (a + b) / 2, with the epsilon of relative_error. The
// denominator has the noise of r, so it is unbiased but for terms of the order of r's relative variance.
//
// standard_error: (x - a)(x - b) = (x - r)^2 - (a - b)^2 / 4 changes by the noise of r times 2 (x - r), and a - b has
// the noise of 2 r, so the sum over blocks of (sum over a block's pixels and channels of w (x - r)(a - b))^2, w the
// weight of a value in the mean, estimates the variance. Pixels of one block may share noise (splats, filters wider
// than a pixel, channels of one path); those of different blocks are taken to be independent. The estimate is exact for
// normal noise, and too large for noise with heavier tails. It counts nothing of the error's spread over the picture:
// `value` is the error of this picture, not of others like it.
struct HalvesOptions {
  int block = 16;  // side of a block in pixels, >= 1
};

// invalid_argument as for error_metrics.h, and for a block below 1.
Result<UnbiasedError> unbiased_squared_error(const PictureView& picture, const PictureView& half_a,
                                             const PictureView& half_b, const HalvesOptions& options = {});
Result<UnbiasedError> unbiased_relative_error(const PictureView& picture, const PictureView& half_a,
                                              const PictureView& half_b,
                                              const RelativeEpsilon& epsilon = RelativeEpsilon::image_mean(),
                                              const HalvesOptions& options = {});

}  // namespace helio
