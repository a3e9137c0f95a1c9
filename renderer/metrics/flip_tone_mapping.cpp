#include "renderer/metrics/flip_tone_mapping.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "renderer/metrics/flip_color.h"

namespace helio {
namespace {

constexpr double kShown = 0.85;       // where the curve brings the median and the maximum
constexpr double kDarkest = 0x1p-23;  // what they count as, at least

// The larger root of curve(x) = kShown, a quadratic equation (Andersson et al. 2021, "Computing Start and Stop
// Exposures").
double brightness_shown_as(const ToneCurve& curve) {
  const double a = curve.k[0] - kShown * curve.k[3], b = curve.k[1] - kShown * curve.k[4],
               c = curve.k[2] - kShown * curve.k[5];
  if (a == 0) return -c / b;
  const double root = std::sqrt(b * b - 4 * a * c);
  return std::max((-b + root) / (2 * a), (-b - root) / (2 * a));
}

// Calls `use` with a function from radiance to displayed RGB.
template <class Use>
void with_display(const FlipDisplay& display, const Use& use) {
  if (!display.tone_mapper) {
    use([](float& r, float& g, float& b) {
      r = clamp_to_display(r);
      g = clamp_to_display(g);
      b = clamp_to_display(b);
    });
    return;
  }
  // At 1e6 all curves are within 1e-5 of their limits, and squares are far from overflow.
  const auto exposed = [factor = display.factor](float radiance) {
    const double value = radiance * factor;
    return float(value < 0 ? 0 : value > 1e6 ? 1e6 : value);
  };
  if (*display.tone_mapper == FlipToneMapper::reinhard) {
    use([exposed](float& r, float& g, float& b) {
      const float er = exposed(r), eg = exposed(g), eb = exposed(b);
      const float scale = 1 / (1 + 0.2126f * er + 0.7152f * eg + 0.0722f * eb);
      r = clamp_to_display(er * scale);
      g = clamp_to_display(eg * scale);
      b = clamp_to_display(eb * scale);
    });
    return;
  }
  use([exposed, curve = tone_curve(*display.tone_mapper)](float& r, float& g, float& b) {
    r = clamp_to_display(curve(exposed(r)));
    g = clamp_to_display(curve(exposed(g)));
    b = clamp_to_display(curve(exposed(b)));
  });
}

// __restrict, here and in the other loops over rows of FLIP: g++ gives up on vector instructions where it would have to
// check six or more pointers for overlap.
template <class Map>
void map_row(const float* __restrict r, const float* __restrict g, const float* __restrict b, float* __restrict to_r,
             float* __restrict to_g, float* __restrict to_b, int width, const Map& map) {
  for (int x = 0; x < width; ++x) {
    float red = r[x], green = g[x], blue = b[x];
    map(red, green, blue);
    to_r[x] = red;
    to_g[x] = green;
    to_b[x] = blue;
  }
}

}  // namespace

FlipRows displayed_rows(const PictureView& picture, const FlipDisplay& display) {
  FlipRows rows;
  with_display(display, [&](const auto& map) {
    rows = [picture, map](int y, float* const* color) {
      const std::size_t start = std::size_t(y) * std::size_t(picture.width);
      map_row(picture.channels[0] + start, picture.channels[1] + start, picture.channels[2] + start, color[0], color[1],
              color[2], picture.width, map);
    };
  });
  return rows;
}

double FlipExposures::factor(int exposure) const {
  return std::exp2(start + (stop - start) * exposure / (count - 1));
}

const ToneCurve& tone_curve(FlipToneMapper mapper) {
  // Narkowicz' (2.51 x^2 + 0.03 x) / (2.43 x^2 + 0.59 x + 0.14) of 0.6 x.
  static constexpr ToneCurve kAces{{0.6f * 0.6f * 2.51f, 0.6f * 0.03f, 0, 0.6f * 0.6f * 2.43f, 0.6f * 0.59f, 0.14f}};
  // ((x (A x + C B) + D E) / (x (A x + B) + D F) - E / F) / (the same at 11.2), A to F = 0.15, 0.5, 0.1, 0.2, 0.02,
  // 0.3, of 2 x.
  static constexpr ToneCurve kHable{{0.231683f, 0.013791f, 0, 0.18f, 0.3f, 0.018f}};
  static constexpr ToneCurve kReinhard{{0, 1, 0, 0, 1, 1}};
  switch (mapper) {
    case FlipToneMapper::hable:
      return kHable;
    case FlipToneMapper::reinhard:
      return kReinhard;
    case FlipToneMapper::aces:
      break;
  }
  return kAces;
}

FlipExposures flip_exposures(const PictureView& reference, FlipToneMapper mapper) {
  std::vector<double> luminances(reference.pixels());
  const float *r = reference.channels[0], *g = reference.channels[1], *b = reference.channels[2];
  const auto value = [](float radiance) { return double(std::max(radiance, 0.0f)); };
  for (std::size_t i = 0; i < luminances.size(); ++i)
    luminances[i] = 0.2126 * value(r[i]) + 0.7152 * value(g[i]) + 0.0722 * value(b[i]);
  const auto middle = luminances.begin() + std::ptrdiff_t(luminances.size() / 2);
  std::nth_element(luminances.begin(), middle, luminances.end());
  const double median = std::max(*middle, kDarkest);
  const double largest = std::max(*std::max_element(middle, luminances.end()), kDarkest);
  const double shown = brightness_shown_as(tone_curve(mapper));
  FlipExposures exposures;
  exposures.start = std::log2(shown / largest);
  exposures.stop = std::log2(shown / median);
  exposures.count = std::max(2, int(std::ceil(exposures.stop - exposures.start)));
  return exposures;
}

}  // namespace helio
