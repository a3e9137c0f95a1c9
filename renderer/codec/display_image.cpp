#include "renderer/codec/display_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "renderer/codec/png_file.h"
#include "renderer/codec/srgb_bytes.h"

namespace helio {
namespace {

constexpr double kMiddleGrey = 0.18;
constexpr double kDarkestShare = 1e-4;  // of the mean: below it a pixel says nothing about exposure
constexpr double kLargestExposure = 0x1p40;
constexpr int kHeatSteps = 1024;  // more than 8 bits can tell apart

// Linear sRGB of an OkLab colour (Ottosson 2020); components outside [0, 1] are outside the gamut.
Rgb from_oklab(float lightness, float a, float b) {
  const float l = lightness + 0.3963377774f * a + 0.2158037573f * b;
  const float m = lightness - 0.1055613458f * a - 0.0638541728f * b;
  const float s = lightness - 0.0894841775f * a - 1.2914855480f * b;
  const float l3 = l * l * l, m3 = m * m * m, s3 = s * s * s;
  return {4.0767416621f * l3 - 3.3077115913f * m3 + 0.2309699292f * s3,
          -1.2684380046f * l3 + 2.6097574011f * m3 - 0.3413193965f * s3,
          -0.0041960863f * l3 - 0.7034186147f * m3 + 1.7076147010f * s3};
}

bool in_gamut(const Rgb& c) {
  return std::min(c.x, std::min(c.y, c.z)) >= 0.0f && max_component(c) <= 1.0f;
}

Rgb evaluate_heat(float t) {
  const float lightness = 0.10f + 0.87f * t;
  const float hue = (290.0f + 175.0f * t) * kPi / 180.0f;
  const auto color = [&](float chroma) {
    return from_oklab(lightness, chroma * std::cos(hue), chroma * std::sin(hue));
  };
  float low = 0, high = 0.03f + 0.17f * std::sin(kPi * t);
  if (in_gamut(color(high))) return color(high);
  for (int i = 0; i < 20; ++i) {  // grey is always in the gamut
    const float middle = 0.5f * (low + high);
    (in_gamut(color(middle)) ? low : high) = middle;
  }
  return color(low);
}

std::array<std::uint8_t, 3> heat_bytes(float t) {
  static const auto table = [] {
    std::array<std::array<std::uint8_t, 3>, kHeatSteps> steps;
    for (int i = 0; i < kHeatSteps; ++i) {
      const Rgb c = heat_color(float(i) / (kHeatSteps - 1));
      steps[std::size_t(i)] = {srgb_byte(c.x), srgb_byte(c.y), srgb_byte(c.z)};
    }
    return steps;
  }();
  if (std::isnan(t)) return {0, 255, 0};
  return table[std::size_t(std::lround(std::clamp(t, 0.0f, 1.0f) * (kHeatSteps - 1)))];
}

}  // namespace

double auto_exposure(const PictureView& picture) {
  std::vector<double> luminances;
  luminances.reserve(picture.pixels());
  double sum = 0;
  for (std::size_t i = 0; i < picture.pixels(); ++i) {
    const double l =
        0.2126 * picture.channels[0][i] + 0.7152 * picture.channels[1][i] + 0.0722 * picture.channels[2][i];
    if (!(l > 0) || !std::isfinite(l)) continue;
    luminances.push_back(l);
    sum += l;
  }
  double log_sum = 0;
  std::size_t counted = 0;
  for (const double l : luminances) {
    if (l < kDarkestShare * sum / double(picture.pixels())) continue;
    log_sum += std::log(l);
    ++counted;
  }
  if (counted == 0) return 1;
  return std::clamp(kMiddleGrey / std::exp(log_sum / double(counted)), 1 / kLargestExposure, kLargestExposure);
}

std::vector<std::uint8_t> display_bytes(const PictureView& picture, double exposure) {
  std::vector<std::uint8_t> bytes(picture.pixels() * 3);
  for (std::size_t c = 0; c < 3; ++c) srgb_bytes(picture.channels[c], picture.pixels(), exposure, bytes.data() + c, 3);
  return bytes;
}

Status write_display_png(const std::string& path, const PictureView& picture, double exposure,
                         const std::string& description) {
  return write_png(path, picture.width, picture.height, display_bytes(picture, exposure), description);
}

Rgb heat_color(float t) {
  if (std::isnan(t)) return {0, 1, 0};
  return evaluate_heat(std::clamp(t, 0.0f, 1.0f));
}

float HeatRange::position(float value) const {
  if (std::isnan(value)) return value;
  if (logarithmic) {
    if (value <= low) return 0;
    if (value >= high) return 1;
    return float(std::log(double(value) / low) / std::log(double(high) / low));
  }
  return float(std::clamp((double(value) - low) / (double(high) - low), 0.0, 1.0));
}

std::string HeatRange::describe() const {
  char text[96];
  std::snprintf(text, sizeof(text), "%.1e to %.1e, %s", double(low), double(high),
                logarithmic ? "logarithmic" : "linear");
  return text;
}

Status write_heat_map_png(const std::string& path, int width, int height, const float* values, const HeatRange& range,
                          const std::string& title) {
  const std::size_t pixels = std::size_t(std::max(0, width)) * std::size_t(std::max(0, height));
  std::vector<std::uint8_t> bytes(pixels * 3);
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::array<std::uint8_t, 3> color = heat_bytes(range.position(values[i]));
    std::copy(color.begin(), color.end(), bytes.begin() + std::ptrdiff_t(3 * i));
  }
  return write_png(path, width, height, bytes, title + ", " + range.describe());
}

}  // namespace helio
