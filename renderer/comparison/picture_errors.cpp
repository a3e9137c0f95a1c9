#include "renderer/comparison/picture_errors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "renderer/base/cancel.h"
#include "renderer/base/check.h"
#include "renderer/metrics/check_pictures.h"
#include "renderer/metrics/dark_half.h"
#include "renderer/metrics/dssim.h"
#include "renderer/metrics/error_metrics.h"
#include "renderer/metrics/flip.h"
#include "renderer/metrics/flip_reference.h"
#include "renderer/metrics/reference_halves.h"
#include "renderer/metrics/weighted_median.h"

namespace helio {
namespace {

constexpr std::size_t kLeastForShare = 1000;  // pixels of which 0.1 % is one

bool has_halves(const ReferenceView& reference) {
  return reference.half_a && reference.half_b;
}

bool relative_error_exists(const PictureView& reference) {
  return RelativeEpsilon::image_mean().added_to_square(picture_mean(reference)).ok();
}

// Precondition: its noise is known.
double variance_at(const ReferenceView& reference, int channel, std::size_t pixel) {
  if (!has_halves(reference)) return reference.variance->channels[channel][pixel];
  // Two independent halves with the variance v of each: (a - b)^2 has the mean 2 v, their mean the variance v / 2.
  const double difference =
      double(reference.half_a->channels[channel][pixel]) - reference.half_b->channels[channel][pixel];
  return difference * difference / 4;
}

// Mean over pixels and channels of variance * weight(r).
template <class Weight>
double mean_variance(const ReferenceView& reference, const Weight& weight) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < reference.mean.pixels(); ++i) {
      sum += variance_at(reference, c, i) * weight(double(reference.mean.channels[c][i]));
    }
  }
  return sum / (3.0 * double(reference.mean.pixels()));
}

// Mean over pixels and channels of variance / (r^2 + epsilon). Preconditions: a reference that is not black, of known
// noise.
double mean_relative_variance(const ReferenceView& reference) {
  const double added = *RelativeEpsilon::image_mean().added_to_square(picture_mean(reference.mean));
  return mean_variance(reference, [added](double r) { return 1 / (r * r + added); });
}

// Standard error of the mean over pixels and channels, over that mean: of independent pixels, whose channels err alike.
// 0: nothing is known of the noise. Precondition: the mean is not 0.
double relative_error_of_mean(const ReferenceView& reference) {
  if (!has_halves(reference) && !reference.variance) return 0;
  double variance = 0;
  for (std::size_t i = 0; i < reference.mean.pixels(); ++i) {
    double deviation = 0;
    for (int c = 0; c < 3; ++c) deviation += std::sqrt(variance_at(reference, c, i));
    variance += deviation * deviation;
  }
  const double error = std::sqrt(variance) / (3.0 * double(reference.mean.pixels()) * picture_mean(reference.mean));
  return std::isfinite(error) ? std::abs(error) : 0;
}

Status check(const PictureView& picture, const ReferenceView& reference) {
  if (Status valid = check_pictures(picture, reference.mean); !valid) return valid;
  HELIO_CHECK(reference.half_a.has_value() == reference.half_b.has_value());
  if (has_halves(reference)) {
    if (Status valid = check_pictures(*reference.half_a, picture, "first half", "picture"); !valid) return valid;
    if (Status valid = check_pictures(*reference.half_b, picture, "second half", "picture"); !valid) return valid;
  } else if (reference.variance) {
    const PictureView& variance = *reference.variance;
    if (Status valid = check_pictures(variance, picture, "variance", "picture"); !valid) return valid;
    for (int c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < variance.pixels(); ++i) {
        if (variance.channels[c][i] >= 0) continue;
        const std::size_t x = i % std::size_t(variance.width), y = i / std::size_t(variance.width);
        return Error{ErrorCode::invalid_argument,
                     "is " + std::to_string(variance.channels[c][i]) + " in channel " + std::to_string(c) +
                         " of pixel (" + std::to_string(x) + ", " + std::to_string(y) + "), must be at least 0",
                     "variance"};
      }
    }
  }
  return ok_status();
}

// Some pixels of pictures, in one row each.
class Selection {
 public:
  Selection(const ReferenceView& reference, std::vector<std::size_t> pixels) : pixels_(std::move(pixels)) {
    reference_.mean = select(reference.mean);
    if (has_halves(reference)) {
      reference_.half_a = select(*reference.half_a);
      reference_.half_b = select(*reference.half_b);
    } else if (reference.variance) {
      reference_.variance = select(*reference.variance);
    }
  }

  const ReferenceView& reference() const { return reference_; }

  // Valid as long as the selection is.
  PictureView select(const PictureView& picture) {
    std::vector<float>& values = storage_.emplace_back(3 * pixels_.size());
    PictureView selected{int(pixels_.size()), 1, {}};
    for (std::size_t c = 0; c < 3; ++c) {
      float* channel = values.data() + c * pixels_.size();
      for (std::size_t i = 0; i < pixels_.size(); ++i) channel[i] = picture.channels[c][pixels_[i]];
      selected.channels[c] = channel;
    }
    return selected;
  }

 private:
  std::vector<std::size_t> pixels_;
  std::vector<std::vector<float>> storage_;  // three channels each; a move of its vectors keeps their values in place
  ReferenceView reference_;
};

// Measures one picture, or some of its pixels, into a list. Preconditions: pictures that check() accepts.
class Measurement {
 public:
  Measurement(const PictureErrorOptions& options, std::vector<MeasuredValue>& values)
      : measures_(options.measures), regions_(options.regions), values_(values) {
    flip_.threads = options.threads;
    flip_.cancel = options.cancel;
  }

  bool wants(Measure measure) const { return (measures_ >> unsigned(measure) & 1u) != 0; }
  Status go_on() const {
    if (!flip_.cancel || !flip_.cancel->cancelled()) return ok_status();
    return Error{ErrorCode::cancelled, "the measures of a picture were cancelled", {}};
  }

  // The measures of regions.
  Status squared_errors(const PictureView& picture, const ReferenceView& reference, const std::string& region) {
    if (Status on = go_on(); !on) return on;
    if (wants(Measure::mse)) {
      const Result<double> value = mse(picture, reference);
      if (!value) return value.error();
      add(Measure::mse, region, *value);
    }
    if (wants(Measure::relmse) && relative_error_exists(reference.mean)) {
      const Result<double> value = relmse(picture, reference);
      if (!value) return value.error();
      add(Measure::relmse, region, *value);
    }
    if (wants(Measure::bias) && picture_mean(reference.mean) != 0) {
      const Result<Bias> value = estimate_bias({&picture, 1}, reference.mean);
      if (!value) return value.error();
      add(Measure::bias, region, value->bias, relative_error_of_mean(reference));
    }
    if (wants(Measure::outlier_share) && picture.pixels() >= kLeastForShare && relative_error_exists(reference.mean)) {
      const Result<RelativeError> value = relative_error(picture, reference.mean);
      if (!value) return value.error();
      add(Measure::outlier_share, region, value->outlier_share);
    }
    return ok_status();
  }

  Status whole_picture(const PictureView& picture, const ReferenceView& reference) {
    if (Status on = go_on(); !on) return on;
    if (wants(Measure::distance_variance)) {
      const Result<SquaredError> error = squared_error(picture, reference.mean);
      if (!error) return error.error();
      add(Measure::distance_variance, {}, error->distance_variance);
    }
    if (wants(Measure::dssim)) {
      const Result<Dssim> structure = dssim(picture, reference.mean);
      if (!structure) return structure.error();
      add(Measure::dssim, {}, structure->dssim);
    }
    if (Status on = go_on(); !on) return on;
    if (wants(Measure::flip) || wants(Measure::flip_median)) {
      const auto map = reference.flip ? ldr_flip(picture, *reference.flip) : ldr_flip(picture, reference.mean, flip_);
      if (Status added = add_flip(map, picture, Measure::flip, Measure::flip_median); !added) return added;
    }
    if (wants(Measure::hdr_flip) || wants(Measure::hdr_flip_median)) {
      const auto map = reference.flip ? hdr_flip(picture, *reference.flip) : hdr_flip(picture, reference.mean, flip_);
      if (Status added = add_flip(map, picture, Measure::hdr_flip, Measure::hdr_flip_median); !added) return added;
    }
    return ok_status();
  }

 private:
  void add(Measure measure, const std::string& region, double value, double reference_error = 0) {
    if (std::isfinite(value)) values_.push_back({measure, region, value, reference_error});
  }

  static Result<double> mse(const PictureView& picture, const ReferenceView& reference) {
    if (has_halves(reference)) {
      const auto unbiased = unbiased_squared_error(picture, *reference.half_a, *reference.half_b);
      if (!unbiased) return unbiased.error();
      return unbiased->value;
    }
    const Result<SquaredError> error = squared_error(picture, reference.mean);
    if (!error) return error.error();
    return error->mse - (reference.variance ? mean_variance(reference, [](double) { return 1.0; }) : 0);
  }

  static Result<double> relmse(const PictureView& picture, const ReferenceView& reference) {
    if (has_halves(reference)) {
      const auto unbiased = unbiased_relative_error(picture, *reference.half_a, *reference.half_b);
      if (!unbiased) return unbiased.error();
      return unbiased->value;
    }
    const Result<RelativeError> error = relative_error(picture, reference.mean);
    if (!error) return error.error();
    return error->relmse - (reference.variance ? mean_relative_variance(reference) : 0);
  }

  Status add_flip(const Result<Flip>& map, const PictureView& picture, Measure mean, Measure median) {
    if (!map) return map.error();
    if (Status added = add_flip(map->error, map->mean, {}, mean, median); !added) return added;
    for (const MeasuredRegion& region : regions_) {
      std::vector<float> errors;
      double sum = 0;
      for (const std::size_t pixel : region.pixels(picture.width, picture.height)) {
        errors.push_back(map->error[pixel]);
        sum += map->error[pixel];
      }
      const double own = sum / double(errors.size());
      if (Status added = add_flip(errors, own, region.name, mean, median); !added) return added;
    }
    return ok_status();
  }

  Status add_flip(const std::vector<float>& errors, double mean_error, const std::string& region, Measure mean,
                  Measure median) {
    if (wants(mean)) add(mean, region, mean_error);
    if (!wants(median)) return ok_status();
    const Result<double> middle = weighted_median(errors);
    if (!middle) return middle.error();
    add(median, region, *middle);
    return ok_status();
  }

  unsigned measures_;
  const std::vector<MeasuredRegion>& regions_;
  FlipOptions flip_;
  std::vector<MeasuredValue>& values_;
};

constexpr unsigned bit(Measure measure) {
  return 1u << unsigned(measure);
}
constexpr unsigned kOfRegions =
    bit(Measure::mse) | bit(Measure::relmse) | bit(Measure::bias) | bit(Measure::outlier_share);

}  // namespace

std::vector<std::size_t> MeasuredRegion::pixels(int width, int height) const {
  std::vector<std::size_t> inside;
  const PixelRect whole{0, 0, width, height}, where = disk ? whole : intersect(rect, whole);
  for (int y = where.y0; y < where.y1; ++y) {
    for (int x = where.x0; x < where.x1; ++x) {
      if (disk && !disk->contains(x, y)) continue;
      inside.push_back(std::size_t(y) * std::size_t(width) + std::size_t(x));
    }
  }
  return inside;
}

Result<std::vector<MeasuredValue>> picture_errors(const PictureView& picture, const ReferenceView& reference,
                                                  const PictureErrorOptions& options) {
  if (Status valid = check(picture, reference); !valid) return valid.error();
  std::vector<MeasuredValue> values;
  Measurement measurement(options, values);
  if (Status done = measurement.squared_errors(picture, reference, {}); !done) return done.error();
  if (Status done = measurement.whole_picture(picture, reference); !done) return done.error();
  if ((options.measures & kOfRegions) == 0) return values;

  const auto measure_part = [&](const std::string& name, std::vector<std::size_t> pixels) {
    Selection part(reference, std::move(pixels));
    return measurement.squared_errors(part.select(picture), part.reference(), name);
  };
  if (Status done = measure_part(kDarkHalf, dark_half_pixels(reference.mean)); !done) return done.error();
  for (const MeasuredRegion& region : options.regions) {
    auto pixels = region.pixels(picture.width, picture.height);
    HELIO_CHECK(!pixels.empty());
    if (Status done = measure_part(region.name, std::move(pixels)); !done) return done.error();
  }
  return values;
}

std::optional<double> reference_error(const ReferenceView& reference) {
  if (!has_halves(reference) && !reference.variance) return std::nullopt;
  if (!check(reference.mean, reference) || !relative_error_exists(reference.mean)) return std::nullopt;
  const double error = std::sqrt(mean_relative_variance(reference));
  return std::isfinite(error) ? std::optional(error) : std::nullopt;
}

std::vector<WorstPixel> worst_pixels(const PictureView& picture, const PictureView& reference, std::size_t count) {
  const Result<std::vector<double>> map = relative_error_map(picture, reference);
  if (!map) return {};
  const std::vector<double>& errors = *map;
  const double total = std::accumulate(errors.begin(), errors.end(), 0.0);
  std::vector<std::size_t> order(errors.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  const std::size_t kept = std::min(count, order.size());
  std::partial_sort(
      order.begin(), order.begin() + std::ptrdiff_t(kept), order.end(),
      [&](std::size_t a, std::size_t b) { return errors[a] != errors[b] ? errors[a] > errors[b] : a < b; });
  std::vector<WorstPixel> worst;
  for (std::size_t i = 0; i < kept && errors[order[i]] > 0; ++i) {
    const std::size_t pixel = order[i], width = std::size_t(picture.width);
    worst.push_back({int(pixel % width), int(pixel / width), std::min(1.0, errors[pixel] / total)});
  }
  return worst;
}

}  // namespace helio
