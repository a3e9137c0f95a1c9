#include "renderer/metrics/reference_halves.h"

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "renderer/metrics/check_pictures.h"

namespace helio {
namespace {

struct Halves {
  const PictureView &a, &b;

  double mean(int channel, std::size_t pixel) const {
    return 0.5 * (double(a.channels[channel][pixel]) + double(b.channels[channel][pixel]));
  }
};

std::optional<Error> check(const PictureView& picture, const Halves& halves, const HalvesOptions& options) {
  if (Status valid = check_pictures(picture, halves.a, "picture", "first half"); !valid) return valid.error();
  if (Status valid = check_pictures(halves.b, halves.a, "second half", "first half"); !valid) return valid.error();
  if (options.block < 1) {
    return Error{ErrorCode::invalid_argument, std::to_string(options.block) + ", must be at least 1", "block"};
  }
  return std::nullopt;
}

// Mean of weight(r) (x - a)(x - b).
template <class Weight>
UnbiasedError weighted_products(const PictureView& picture, const Halves& halves, int block, const Weight& weight) {
  const int columns = (picture.width - 1) / block + 1;
  std::vector<double> blocks(std::size_t(columns), 0.0);  // of the current row of blocks: sums of (x - r)(a - b)
  double products = 0, variance = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const std::size_t i = std::size_t(y) * std::size_t(picture.width) + std::size_t(x);
      for (int c = 0; c < 3; ++c) {
        const double value = picture.channels[c][i], a = halves.a.channels[c][i], b = halves.b.channels[c][i];
        const double r = halves.mean(c, i), w = weight(r);
        products += w * (value - a) * (value - b);
        blocks[std::size_t(x / block)] += w * (value - r) * (a - b);
      }
    }
    if ((y + 1) % block != 0 && y + 1 != picture.height) continue;
    for (double& sum : blocks) {
      variance += sum * sum;
      sum = 0;
    }
  }
  const double count = 3.0 * double(picture.pixels());
  return {products / count, std::sqrt(variance) / count};
}

}  // namespace

Result<UnbiasedError> unbiased_squared_error(const PictureView& picture, const PictureView& half_a,
                                             const PictureView& half_b, const HalvesOptions& options) {
  const Halves halves{half_a, half_b};
  if (const auto error = check(picture, halves, options)) return *error;
  return weighted_products(picture, halves, options.block, [](double) { return 1.0; });
}

Result<UnbiasedError> unbiased_relative_error(const PictureView& picture, const PictureView& half_a,
                                              const PictureView& half_b, const RelativeEpsilon& epsilon,
                                              const HalvesOptions& options) {
  const Halves halves{half_a, half_b};
  if (const auto error = check(picture, halves, options)) return *error;
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < picture.pixels(); ++i) sum += halves.mean(c, i);
  }
  const Result<double> added = epsilon.added_to_square(sum / (3.0 * double(picture.pixels())));
  if (!added) return added.error();
  return weighted_products(picture, halves, options.block, [added = *added](double r) { return 1 / (r * r + added); });
}

}  // namespace helio
