#include "renderer/metrics/dssim.h"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/srgb.h"
#include "renderer/metrics/check_pictures.h"

namespace helio {
namespace {

constexpr int kRadius = 5;
constexpr double kSigma = 1.5;
constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;

using Plane = std::vector<double>;

std::array<double, 2 * kRadius + 1> gaussian_taps() {
  std::array<double, 2 * kRadius + 1> taps;
  for (int i = -kRadius; i <= kRadius; ++i) taps[std::size_t(i + kRadius)] = std::exp(-0.5 * i * i / (kSigma * kSigma));
  return taps;
}

// Weighted mean along one axis: `count` lines of `length` values; taps outside a line are left out.
Plane blur_lines(const Plane& in, int count, int length, std::size_t line_step, std::size_t value_step) {
  static const auto taps = gaussian_taps();
  Plane out(in.size());
  for (int line = 0; line < count; ++line) {
    const std::size_t start = std::size_t(line) * line_step;
    for (int i = 0; i < length; ++i) {
      double sum = 0, weight = 0;
      for (int k = std::max(0, i - kRadius); k <= std::min(length - 1, i + kRadius); ++k) {
        const double tap = taps[std::size_t(k - i + kRadius)];
        sum += tap * in[start + std::size_t(k) * value_step];
        weight += tap;
      }
      out[start + std::size_t(i) * value_step] = sum / weight;
    }
  }
  return out;
}

Plane blur(const Plane& in, int width, int height) {
  const std::size_t w = std::size_t(width);
  return blur_lines(blur_lines(in, height, width, w, 1), width, height, 1, w);
}

Plane encoded_luminance(const PictureView& picture, double exposure) {
  Plane out(picture.pixels());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Rgb color(picture.channels[0][i], picture.channels[1][i], picture.channels[2][i]);
    out[i] = encode_srgb(float(exposure * luminance(color)));
  }
  return out;
}

Plane product(const Plane& a, const Plane& b) {
  Plane out(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) out[i] = a[i] * b[i];
  return out;
}

}  // namespace

Result<Dssim> dssim(const PictureView& picture, const PictureView& reference, double exposure) {
  if (Status valid = check_pictures(picture, reference); !valid) return valid.error();
  if (!(exposure > 0) || !std::isfinite(exposure)) {
    return Error{ErrorCode::invalid_argument, "must be positive and finite", "exposure"};
  }
  const int w = picture.width, h = picture.height;
  const Plane x = encoded_luminance(picture, exposure), y = encoded_luminance(reference, exposure);
  const Plane mx = blur(x, w, h), my = blur(y, w, h);
  const Plane xx = blur(product(x, x), w, h), yy = blur(product(y, y), w, h), xy = blur(product(x, y), w, h);
  double total = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double vx = xx[i] - mx[i] * mx[i], vy = yy[i] - my[i] * my[i], cov = xy[i] - mx[i] * my[i];
    total += (2 * mx[i] * my[i] + kC1) * (2 * cov + kC2) / ((mx[i] * mx[i] + my[i] * my[i] + kC1) * (vx + vy + kC2));
  }
  Dssim result;
  result.ssim = total / double(x.size());
  result.dssim = result.ssim > 0 ? 1 / result.ssim - 1 : std::numeric_limits<double>::infinity();
  return result;
}

}  // namespace helio
