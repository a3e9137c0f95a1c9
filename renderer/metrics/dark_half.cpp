#include "renderer/metrics/dark_half.h"

#include <algorithm>
#include <cmath>

#include "renderer/base/math.h"
#include "renderer/metrics/error_metrics.h"

namespace helio {

std::vector<std::size_t> dark_half_pixels(const PictureView& reference) {
  const std::size_t pixels = reference.pixels();
  if (pixels == 0) return {};
  std::vector<float> brightness(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    brightness[i] = luminance(Rgb(reference.channels[0][i], reference.channels[1][i], reference.channels[2][i]));
  }
  std::vector<float> sorted = brightness;
  const auto middle = sorted.begin() + std::ptrdiff_t((pixels - 1) / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  std::vector<std::size_t> dark;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (brightness[i] <= *middle) dark.push_back(i);
  }
  return dark;
}

DarkHalf compare_dark_half(const PictureView& picture, const PictureView& reference) {
  const std::vector<std::size_t> dark = dark_half_pixels(reference);
  const double values = 3.0 * double(dark.size());
  double mean = 0, difference = 0, relative = 0;
  for (int c = 0; c < 3; ++c) {
    for (const std::size_t i : dark) {
      mean += reference.channels[c][i] / values;
      difference += (double(picture.channels[c][i]) - reference.channels[c][i]) / values;
    }
  }
  const double epsilon = RelativeEpsilon::image_mean().value * mean * mean;
  for (int c = 0; c < 3; ++c) {
    for (const std::size_t i : dark) {
      const double r = reference.channels[c][i], d = picture.channels[c][i] - r;
      relative += d * d / (r * r + epsilon) / values;
    }
  }
  if (mean == 0) return {std::nan(""), std::nan("")};
  return {relative, difference / mean};
}

}  // namespace helio
