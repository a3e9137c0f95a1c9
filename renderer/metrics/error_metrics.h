// How far a picture is from its reference: the definitions that tests, benches and reports share.
//
// Values are compared per pixel and channel; "mean" is over both. The pictures must have the same size, at least one
// pixel and finite values: invalid_argument otherwise.
#pragma once

#include <span>
#include <vector>

#include "renderer/base/picture_view.h"
#include "renderer/base/result.h"

namespace helio {

// Mean over pixels and channels. Precondition: at least one pixel.
double picture_mean(const PictureView& picture);

struct SquaredError {
  double mse = 0;                // mean((x - r)^2); Schalk 2018, eq. 2
  double distance_variance = 0;  // variance over pixels and channels of |x - r| (Schalk 2018, chapter 4)
};
Result<SquaredError> squared_error(const PictureView& picture, const PictureView& reference);

// What is added to r^2 in the denominator of the relative error.
struct RelativeEpsilon {
  enum class Kind { fixed, of_image_mean };
  Kind kind = Kind::of_image_mean;
  double value = 1e-2;  // fixed: radiance squared, > 0; of_image_mean: times mean(r)^2, > 0

  // 1e-2 mean(r)^2: does not depend on the unit of radiance and does not hide the dark half of a picture.
  static RelativeEpsilon image_mean() { return {}; }
  // The epsilon of the benches against other renderers.
  static RelativeEpsilon fixed(double value = 0.01) { return {Kind::fixed, value}; }

  // For a reference of that mean, over pixels and channels. invalid_argument when it is not positive.
  Result<double> added_to_square(double reference_mean) const;
};

struct RelativeError {
  double relmse = 0;            // mean((x - r)^2 / (r^2 + epsilon))
  double without_outliers = 0;  // the same without the 0.1 % of pixels (at least one) with the largest error
  double outlier_share = 0;     // [0, 1]: what part of the sum those pixels have
};
// invalid_argument also when epsilon is not positive (of_image_mean with a black reference: no relative error exists).
Result<RelativeError> relative_error(const PictureView& picture, const PictureView& reference,
                                     const RelativeEpsilon& epsilon = RelativeEpsilon::image_mean());

// Of each pixel, row-major: the sum over channels of (x - r)^2 / (r^2 + epsilon), of which `relmse` is a third of the
// mean. Errors as for relative_error.
Result<std::vector<double>> relative_error_map(const PictureView& picture, const PictureView& reference,
                                               const RelativeEpsilon& epsilon = RelativeEpsilon::image_mean());

struct Bias {
  double bias = 0;            // mean(x - r) / mean(r), averaged over the pictures
  double standard_error = 0;  // of `bias`, from the spread over the pictures; +infinity for a single one
};
// `pictures` are independent renderings of one view, one per seed. The error of the reference is not included.
Result<Bias> estimate_bias(std::span<const PictureView> pictures, const PictureView& reference);

}  // namespace helio
