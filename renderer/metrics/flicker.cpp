#include "renderer/metrics/flicker.h"

#include <cmath>
#include <optional>
#include <sstream>

#include "renderer/metrics/check_pictures.h"

namespace helio {
namespace {

std::optional<Error> check_positions(const PreviousPositions& positions, const PictureView& picture) {
  if (positions.width == picture.width && positions.height == picture.height) return std::nullopt;
  std::ostringstream text;
  text << positions.width << "x" << positions.height << ", must be the picture's " << picture.width << "x"
       << picture.height;
  return Error{ErrorCode::invalid_argument, text.str(), "previous positions"};
}

// `error` and `previous_error`: (channel, pixel) to a value.
template <class PreviousError, class CurrentError>
Result<Flicker> mean_change(const PreviousError& previous_error, const CurrentError& error,
                            const PreviousPositions& positions, const std::vector<std::size_t>* some = nullptr) {
  const std::size_t width = std::size_t(positions.width);
  const std::size_t pixels = some ? some->size() : width * std::size_t(positions.height);
  double sum = 0;
  std::size_t seen = 0;
  for (std::size_t k = 0; k < pixels; ++k) {
    const std::size_t i = some ? (*some)[k] : k;
    const float x = positions.x[i], y = positions.y[i];
    if (!(x >= 0 && y >= 0 && x < float(positions.width) && y < float(positions.height))) continue;
    const std::size_t before = std::size_t(y) * width + std::size_t(x);
    for (int c = 0; c < 3; ++c) sum += std::abs(error(c, i) - previous_error(c, before));
    ++seen;
  }
  if (seen == 0) {
    return Error{ErrorCode::failed_precondition, "no pixel was seen in the picture before", "previous positions"};
  }
  return Flicker{sum / (3.0 * double(seen)), 1 - double(seen) / double(pixels)};
}

auto errors_of(const FlickerFrame& frame) {
  return [&frame](int c, std::size_t i) {
    return double(frame.picture.channels[c][i]) - double(frame.reference.channels[c][i]);
  };
}

auto values_of(const PictureView& error) {
  return [&error](int c, std::size_t i) { return double(error.channels[c][i]); };
}

}  // namespace

Result<Flicker> flicker(const FlickerFrame& previous, const FlickerFrame& frame, const PreviousPositions& positions) {
  if (Status valid = check_pictures(frame.picture, frame.reference); !valid) return valid.error();
  if (Status valid = check_pictures(previous.picture, frame.picture, "previous picture", "picture"); !valid)
    return valid.error();
  if (Status valid = check_pictures(previous.reference, frame.picture, "previous reference", "picture"); !valid)
    return valid.error();
  if (const auto error = check_positions(positions, frame.picture)) return *error;
  return mean_change(errors_of(previous), errors_of(frame), positions);
}

Result<Flicker> flicker(const PictureView& previous_error, const PictureView& error,
                        const PreviousPositions& positions, const std::vector<std::size_t>* pixels) {
  if (Status valid = check_pictures(error, previous_error, "error image", "previous error image"); !valid)
    return valid.error();
  if (const auto problem = check_positions(positions, error)) return *problem;
  return mean_change(values_of(previous_error), values_of(error), positions, pixels);
}

}  // namespace helio
