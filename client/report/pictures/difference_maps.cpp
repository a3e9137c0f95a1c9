#include "client/report/pictures/difference_maps.h"

#include <algorithm>
#include <cmath>

#include "renderer/base/srgb.h"
#include "renderer/codec/display_image.h"
#include "renderer/metrics/flip.h"
#include "renderer/metrics/weighted_median.h"

namespace helio::report {
namespace {

constexpr double kWeights[3] = {0.2126, 0.7152, 0.0722};  // of luminance, Rec. 709
constexpr double kEpsilon = 0.01;                         // of the relative error, times the squared mean

std::vector<double> luminances(const LoadedPicture& picture) {
  std::vector<double> out(picture.planes[0].size());
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] += kWeights[c] * picture.planes[c][i];
  }
  return out;
}

// The variance of a pixel's luminance, were the channels' errors independent.
double luminance_variance(const LoadedPicture& picture, std::size_t pixel) {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += kWeights[c] * kWeights[c] * (*picture.variance)[c][pixel];
  return sum;
}

// Each pixel's is the mean over 3x3 pixels: a reference's variance may be that of two halves' difference, which alone
// says next to nothing of its own pixel.
std::vector<double> smoothed_luminance_variances(const LoadedPicture& picture) {
  std::vector<double> smoothed;
  smoothed.reserve(picture.planes[0].size());
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      double sum = 0;
      int count = 0;
      for (int v = std::max(y - 1, 0); v <= std::min(y + 1, picture.height - 1); ++v) {
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, picture.width - 1); ++u, ++count)
          sum += luminance_variance(picture, std::size_t(v) * std::size_t(picture.width) + std::size_t(u));
      }
      smoothed.push_back(sum / count);
    }
  }
  return smoothed;
}

std::uint8_t byte_of(float share) {
  return std::uint8_t(std::lround(255 * std::clamp(share, 0.0f, 1.0f)));
}

}  // namespace

Result<FlipMap> flip_map(const LoadedPicture& picture, const LoadedPicture& reference) {
  Result<Flip> flip = hdr_flip(picture.view(), reference.view());
  if (!flip) return flip.error();
  const Result<double> median = weighted_median(flip->error);
  if (!median) return median.error();
  return FlipMap{{picture.width, picture.height, std::move(flip->error)}, flip->mean, *median};
}

SignedMap signed_map(const LoadedPicture& picture, const LoadedPicture& reference) {
  const std::vector<double> x = luminances(picture), r = luminances(reference);
  SignedMap out{{picture.width, picture.height, std::vector<float>(x.size())},
                picture.variance.has_value() && reference.variance.has_value()};
  const std::vector<double> noise =
      out.standard_errors ? smoothed_luminance_variances(reference) : std::vector<double>();
  double mean = 0;
  for (const double value : r) mean += value / double(r.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    double position = 0;  // in [-1, 1]
    if (out.standard_errors) {
      const double deviation = std::sqrt(luminance_variance(picture, i) + noise[i]);
      position = deviation > 0 ? (x[i] - r[i]) / (deviation * kSignedMapErrors) : 0;
    } else {
      const double scale = std::sqrt(r[i] * r[i] + kEpsilon * mean * mean);
      position = scale > 0 ? (x[i] - r[i]) / (scale * kSignedMapShare) : 0;
    }
    out.map.values[i] = std::isfinite(position) ? float(0.5 + 0.5 * std::clamp(position, -1.0, 1.0)) : 0.5f;
  }
  return out;
}

DifferenceMap reduced(const DifferenceMap& map, int factor) {
  return {(map.width + factor - 1) / factor, (map.height + factor - 1) / factor,
          reduced(map.values, map.width, map.height, factor)};
}

const Palette& flip_palette() {
  static const Palette palette = [] {
    Palette colors{};
    for (std::size_t i = 0; i < colors.size(); ++i) {
      const Rgb c = heat_color(float(i) / 255);
      colors[i] = {byte_of(encode_srgb(c.x)), byte_of(encode_srgb(c.y)), byte_of(encode_srgb(c.z))};
    }
    return colors;
  }();
  return palette;
}

const Palette& signed_palette() {
  static const Palette palette = [] {
    // sRGB at both ends, at half of the way to either, and in the middle.
    static constexpr float kStops[5][3] = {
        {8, 48, 107}, {66, 146, 198}, {245, 245, 245}, {230, 110, 60}, {127, 20, 10}};
    Palette colors{};
    for (std::size_t i = 0; i < colors.size(); ++i) {
      const float at = 4 * float(i) / 255;
      const int stop = std::min(3, int(at));
      for (std::size_t c = 0; c < 3; ++c) {
        colors[i][c] = byte_of(std::lerp(kStops[stop][c], kStops[stop + 1][c], at - float(stop)) / 255);
      }
    }
    return colors;
  }();
  return palette;
}

std::vector<std::uint8_t> to_png(const DifferenceMap& map, const Palette& palette) {
  std::vector<std::uint8_t> indices(map.values.size());
  std::transform(map.values.begin(), map.values.end(), indices.begin(), byte_of);
  return png_of_indices(map.width, map.height, indices, palette);
}

}  // namespace helio::report
