#include "renderer/metrics/flip.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

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
    // Apart from the powers, which no vector instruction has.
    for (std::size_t i = 0; i < width_; ++i) {
      difference_[i] = hyab_distance({p.l[i], p.a[i], p.b[i]}, {q.l[i], q.a[i], q.b[i]});
      const float edge = std::abs(x.edge[i] - r.edge[i]), point = std::abs(x.point[i] - r.point[i]);
      feature_[i] = std::sqrt((edge > point ? edge : point) * 0.70710678f);
    }
    for (std::size_t i = 0; i < width_; ++i) {
      const float color = redistribute(std::pow(difference_[i], kExponent));
      error[i] = std::max(error[i], std::pow(color, std::max(0.0f, 1 - feature_[i])));
    }
  }

  float redistribute(float difference) const {
    const float end = kLineEnd * largest_;
    if (difference < end) return kLineValue / end * difference;
    return std::min(1.0f, kLineValue + (difference - end) / (largest_ - end) * (1 - kLineValue));
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
  FlipComparison comparison(kernels, picture.width, picture.height);
  const FlipExposures range = flip_exposures(reference, options.tone_mapper);
  Flip flip;
  flip.start_exposure = range.start;
  flip.stop_exposure = range.stop;
  flip.exposures = range.count;
  flip.error.assign(picture.pixels(), 0.0f);
  for (int i = 0; i < range.count; ++i) {
    const double factor = std::exp2(range.start + (range.stop - range.start) * i / (range.count - 1));
    with_tone_mapping(options.tone_mapper, factor, [&](const auto& map) {
      comparison.compare(mapped_rows(picture, map), mapped_rows(reference, map), flip.error);
    });
    if (!(range.stop > range.start)) break;  // all exposures are one
  }
  flip.mean = mean_of(flip.error);
  return flip;
}

}  // namespace helio
