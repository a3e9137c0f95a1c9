#include "renderer/metrics/flip.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <future>
#include <optional>
#include <sstream>
#include <string>

#include "renderer/metrics/check_pictures.h"
#include "renderer/metrics/flip_color.h"
#include "renderer/metrics/flip_filter.h"
#include "renderer/metrics/flip_tone_mapping.h"

namespace helio {
namespace {

// Andersson et al. 2020, error redistribution: differences to the power kExponent; the first line ends at kLineEnd of
// the largest, and there at kLineValue.
constexpr float kExponent = 0.7f;
constexpr float kLineEnd = 0.4f, kLineValue = 0.95f;

// x^exponent, x and exponent >= 0, x at most 1e30, relative error below 1e-5: std::pow, which no vector instruction
// has, took half of FLIP's time. log2 by the series of artanh((m - 1) / (m + 1)), m in [sqrt(1/2), sqrt(2)); 2^f by its
// series, f in [-1/2, 1/2].
inline float power(float x, float exponent) {
  constexpr float kLeast = 1e-30f;
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(x > kLeast ? x : kLeast);
  const auto scale = std::int32_t(bits - 0x3f3504f3u) >> 23;
  const float m = std::bit_cast<float>(bits - (std::uint32_t(scale) << 23));
  const float t = (m - 1) / (m + 1), t2 = t * t;
  const float log2 = float(scale) + t * (2.885390082f + t2 * (0.961796694f + t2 * (0.577078016f + t2 * 0.412198583f)));
  const float product = exponent * log2;
  const float y = product > -126 ? product : -126;
  const auto whole = std::int32_t(y + (y < 0 ? -0.5f : 0.5f));
  const float f = y - float(whole);
  const float root =
      1 +
      f * (0.693147181f + f * (0.240226507f + f * (0.0555041087f +
                                                   f * (0.00961812911f + f * (0.00133335581f + f * 0.000154035304f)))));
  const float result = root * std::bit_cast<float>(std::uint32_t(whole + 127) << 23);
  // Products, because g++ makes branches of more choices, and a loop with branches no vector instructions.
  const float positive = x > 0 ? 1.0f : 0.0f, of_zero = exponent > 0 ? 0.0f : 1.0f;
  return positive * result + (1 - positive) * of_zero;
}

// Between green and blue, the largest that linear RGB in [0, 1] allows.
float largest_color_difference() {
  const HuntLab green = hunt_lab(kWhiteXFromRgb[1], kWhiteYFromRgb[1], kWhiteZFromRgb[1]);
  const HuntLab blue = hunt_lab(kWhiteXFromRgb[2], kWhiteYFromRgb[2], kWhiteZFromRgb[2]);
  return std::pow(hyab_distance(green, blue), kExponent);
}

struct HuntLabRow {
  std::vector<float> l, a, b;

  explicit HuntLabRow(std::size_t width) : l(width), a(width), b(width) {}
};

void convert(const FlipFilter::Row& row, HuntLabRow& to) {
  const float *y = row.y.data(), *cx = row.cx.data(), *cz = row.cz.data();
  float *l = to.l.data(), *a = to.a.data(), *b = to.b.data();
  for (std::size_t i = 0; i < to.l.size(); ++i) {
    const HuntLab lab = clamped_hunt_lab(y[i] + cx[i], y[i], y[i] - cz[i]);
    l[i] = lab.l;
    a[i] = lab.a;
    b[i] = lab.b;
  }
}

// Pairs of pictures of one size, one after the other.
class FlipComparison {
 public:
  FlipComparison(const FlipKernels& kernels, int width, int height)
      : width_(std::size_t(width)),
        height_(height),
        largest_(largest_color_difference()),
        picture_(kernels, width, height),
        reference_(kernels, width, height),
        picture_lab_(width_),
        reference_lab_(width_),
        difference_(width_),
        feature_(width_) {}

  // error = max(error, FLIP). `fill_*`: as FlipFilter::row.
  template <class Fill>
  void compare(const Fill& fill_picture, const Fill& fill_reference, std::vector<float>& error) {
    for (int y = 0; y < height_; ++y) {
      const FlipFilter::Row& x = picture_.row(y, fill_picture);
      const FlipFilter::Row& r = reference_.row(y, fill_reference);
      compare_rows(x, r, &error[std::size_t(y) * width_]);
    }
  }

 private:
  void compare_rows(const FlipFilter::Row& x, const FlipFilter::Row& r, float* error) {
    convert(x, picture_lab_);
    convert(r, reference_lab_);
    const HuntLabRow &p = picture_lab_, &q = reference_lab_;
    for (std::size_t i = 0; i < width_; ++i) {
      difference_[i] = hyab_distance({p.l[i], p.a[i], p.b[i]}, {q.l[i], q.a[i], q.b[i]});
      const float edge = std::abs(x.edge[i] - r.edge[i]), point = std::abs(x.point[i] - r.point[i]);
      feature_[i] = std::sqrt((edge > point ? edge : point) * 0.70710678f);
    }
    redistribute(difference_.data(), feature_.data(), error);
  }

  // error = max(error, the difference redistributed, to the power of 1 - feature).
  void redistribute(const float* difference, const float* feature, float* error) const {
    const float end = kLineEnd * largest_, first = kLineValue / end;
    const float second = (1 - kLineValue) / (largest_ - end);
    for (std::size_t i = 0; i < width_; ++i) {
      const float d = power(difference[i], kExponent);
      const float above = kLineValue + (d - end) * second;
      const float on_first = first * d, on_second = above < 1 ? above : 1;
      const float color = d < end ? on_first : on_second;
      const float left = 1 - feature[i], exponent = left > 0 ? left : 0;
      const float value = power(color, exponent);
      const float most = error[i];
      error[i] = value > most ? value : most;
    }
  }

  std::size_t width_;
  int height_;
  float largest_;
  FlipFilter picture_, reference_;
  HuntLabRow picture_lab_, reference_lab_;
  std::vector<float> difference_, feature_;
};

std::optional<Error> check(const PictureView& picture, const PictureView& reference, const FlipOptions& options) {
  if (Status valid = check_pictures(picture, reference); !valid) return valid.error();
  if (!(options.pixels_per_degree >= 1 && options.pixels_per_degree <= 1000)) {
    std::ostringstream text;
    text << options.pixels_per_degree << ", must be from 1 to 1000";
    return Error{ErrorCode::invalid_argument, text.str(), "pixels_per_degree"};
  }
  if (options.threads < 1 || options.threads > 64)
    return Error{ErrorCode::invalid_argument, std::to_string(options.threads) + ", must be from 1 to 64", "threads"};
  return std::nullopt;
}

double mean_of(const std::vector<float>& error) {
  double sum = 0;
  for (const float value : error) sum += value;
  return sum / double(error.size());
}

// Rows of `picture` through `map`, from three values to three in [0, 1].
template <class Map>
auto mapped_rows(const PictureView& picture, const Map& map) {
  return [&picture, map](int y, float* const* color) {
    const std::size_t start = std::size_t(y) * std::size_t(picture.width);
    const float *r = picture.channels[0] + start, *g = picture.channels[1] + start, *b = picture.channels[2] + start;
    float *to_r = color[0], *to_g = color[1], *to_b = color[2];
    for (int x = 0; x < picture.width; ++x) {
      const DisplayColor shown = map(r[x], g[x], b[x]);
      to_r[x] = shown.r;
      to_g[x] = shown.g;
      to_b[x] = shown.b;
    }
  };
}

}  // namespace

Result<Flip> ldr_flip(const PictureView& picture, const PictureView& reference, const FlipOptions& options) {
  if (const auto error = check(picture, reference, options)) return *error;
  const FlipKernels kernels(options.pixels_per_degree);
  FlipComparison comparison(kernels, picture.width, picture.height);
  const auto clamp = [](float r, float g, float b) { return clamped(r, g, b); };
  Flip flip;
  flip.error.assign(picture.pixels(), 0.0f);
  comparison.compare(mapped_rows(picture, clamp), mapped_rows(reference, clamp), flip.error);
  flip.mean = mean_of(flip.error);
  return flip;
}

Result<Flip> hdr_flip(const PictureView& picture, const PictureView& reference, const FlipOptions& options) {
  if (const auto error = check(picture, reference, options)) return *error;
  const FlipKernels kernels(options.pixels_per_degree);
  const FlipExposures range = flip_exposures(reference, options.tone_mapper);
  const int exposures = range.stop > range.start ? range.count : 1;  // else all are one
  const int threads = std::min(options.threads, exposures);
  // Of exposures first, first + threads, ...: the largest error of each pixel.
  const auto largest = [&](int first) {
    FlipComparison comparison(kernels, picture.width, picture.height);
    std::vector<float> error(picture.pixels(), 0.0f);
    for (int i = first; i < exposures; i += threads) {
      const double factor = std::exp2(range.start + (range.stop - range.start) * i / (range.count - 1));
      with_tone_mapping(options.tone_mapper, factor, [&](const auto& map) {
        comparison.compare(mapped_rows(picture, map), mapped_rows(reference, map), error);
      });
    }
    return error;
  };
  std::vector<std::future<std::vector<float>>> others;
  for (int first = 1; first < threads; ++first) others.push_back(std::async(std::launch::async, largest, first));
  Flip flip;
  flip.start_exposure = range.start;
  flip.stop_exposure = range.stop;
  flip.exposures = range.count;
  flip.error = largest(0);
  for (auto& other : others) {
    const std::vector<float> error = other.get();
    for (std::size_t i = 0; i < error.size(); ++i) flip.error[i] = std::max(flip.error[i], error[i]);
  }
  flip.mean = mean_of(flip.error);
  return flip;
}

}  // namespace helio
