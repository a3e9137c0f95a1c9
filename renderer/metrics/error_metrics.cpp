#include "renderer/metrics/error_metrics.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "renderer/metrics/check_pictures.h"

namespace helio {
namespace {

constexpr double kOutlierShare = 0.001;

}  // namespace

double picture_mean(const PictureView& picture) {
  double total = 0;
  for (const float* channel : picture.channels) {
    for (std::size_t i = 0; i < picture.pixels(); ++i) total += channel[i];
  }
  return total / (3.0 * double(picture.pixels()));
}

Result<SquaredError> squared_error(const PictureView& picture, const PictureView& reference) {
  if (Status valid = check_pictures(picture, reference); !valid) return valid.error();
  double squares = 0, distances = 0;
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < picture.pixels(); ++i) {
      const double d = std::abs(double(picture.channels[c][i]) - reference.channels[c][i]);
      squares += d * d;
      distances += d;
    }
  }
  const double n = 3.0 * double(picture.pixels());
  SquaredError error;
  error.mse = squares / n;
  error.distance_variance = std::max(0.0, error.mse - (distances / n) * (distances / n));
  return error;
}

Result<double> RelativeEpsilon::added_to_square(double reference_mean) const {
  const double added = kind == Kind::of_image_mean ? value * (reference_mean * reference_mean) : value;
  if (added > 0) return added;
  return Error{ErrorCode::invalid_argument,
               "must be positive; relative to a black reference there is no relative error", "epsilon"};
}

Result<std::vector<double>> relative_error_map(const PictureView& picture, const PictureView& reference,
                                               const RelativeEpsilon& epsilon) {
  if (Status valid = check_pictures(picture, reference); !valid) return valid.error();
  const Result<double> positive = epsilon.added_to_square(picture_mean(reference));
  if (!positive) return positive.error();
  const double added = *positive;
  std::vector<double> errors(picture.pixels(), 0.0);
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const double r = reference.channels[c][i];
      const double d = picture.channels[c][i] - r;
      errors[i] += d * d / (r * r + added);
    }
  }
  return errors;
}

Result<RelativeError> relative_error(const PictureView& picture, const PictureView& reference,
                                     const RelativeEpsilon& epsilon) {
  Result<std::vector<double>> map = relative_error_map(picture, reference, epsilon);
  if (!map) return map.error();
  std::vector<double>& errors = *map;
  const std::size_t pixels = errors.size();
  double total = 0;
  for (const double e : errors) total += e;
  const std::size_t outliers = std::max<std::size_t>(1, std::size_t(kOutlierShare * double(pixels)));
  std::nth_element(errors.begin(), errors.begin() + std::ptrdiff_t(outliers) - 1, errors.end(), std::greater<>());
  double largest = 0;
  for (std::size_t i = 0; i < outliers; ++i) largest += errors[i];
  RelativeError result;
  result.relmse = total / (3.0 * double(pixels));
  result.without_outliers = pixels > outliers ? std::max(0.0, total - largest) / (3.0 * double(pixels - outliers)) : 0;
  result.outlier_share = total > 0 ? std::min(1.0, largest / total) : 0;
  return result;
}

Result<Bias> estimate_bias(std::span<const PictureView> pictures, const PictureView& reference) {
  if (pictures.empty()) return Error{ErrorCode::invalid_argument, "at least one is needed", "pictures"};
  std::vector<double> biases;
  for (const PictureView& picture : pictures) {
    if (Status valid = check_pictures(picture, reference); !valid) return valid.error();
    biases.push_back(picture_mean(picture));
  }
  const double reference_mean = picture_mean(reference);
  if (!(std::abs(reference_mean) > 0)) {
    return Error{ErrorCode::invalid_argument, "has mean 0: no relative bias exists", "reference"};
  }
  const double n = double(biases.size());
  double sum = 0;
  for (double& b : biases) sum += b = (b - reference_mean) / reference_mean;
  Bias result;
  result.bias = sum / n;
  double squares = 0;
  for (const double b : biases) squares += (b - result.bias) * (b - result.bias);
  result.standard_error = n > 1 ? std::sqrt(squares / (n - 1) / n) : std::numeric_limits<double>::infinity();
  return result;
}

}  // namespace helio
