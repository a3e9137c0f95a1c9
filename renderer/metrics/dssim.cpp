#include "renderer/metrics/dssim.h"

#include <algorithm>
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

double tap(int offset) {
  static const auto taps = gaussian_taps();
  return taps[std::size_t(offset + kRadius)];
}

// Sum of the taps that lie inside, of each place on a line.
std::vector<double> weights(int length) {
  std::vector<double> weights(std::size_t(length), 0.0);
  for (int i = 0; i < length; ++i) {
    for (int k = -kRadius; k <= kRadius; ++k) {
      if (i + k >= 0 && i + k < length) weights[std::size_t(i)] += tap(k);
    }
  }
  return weights;
}

void add_scaled(const double* __restrict values, double factor, std::size_t count, double* __restrict sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] += factor * values[i];
}

// Weighted mean; taps outside the picture are left out.
Plane blur(const Plane& in, int width, int height) {
  const std::size_t w = std::size_t(width);
  const std::vector<double> across = weights(width), down = weights(height);
  Plane rows(in.size(), 0.0), out(in.size(), 0.0);
  for (int y = 0; y < height; ++y) {
    const double* from = &in[std::size_t(y) * w];
    double* to = &rows[std::size_t(y) * w];
    for (int k = -kRadius; k <= kRadius; ++k) {
      const int first = std::max(0, -k), last = std::min(width, width - k);
      if (first < last) add_scaled(from + first + k, tap(k), std::size_t(last - first), to + first);
    }
    for (std::size_t x = 0; x < w; ++x) to[x] /= across[x];
  }
  for (int y = 0; y < height; ++y) {
    double* to = &out[std::size_t(y) * w];
    for (int k = std::max(0, y - kRadius); k <= std::min(height - 1, y + kRadius); ++k)
      add_scaled(&rows[std::size_t(k) * w], tap(k - y), w, to);
    for (std::size_t x = 0; x < w; ++x) to[x] /= down[std::size_t(y)];
  }
  return out;
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
