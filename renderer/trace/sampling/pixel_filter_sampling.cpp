#include "renderer/trace/sampling/pixel_filter_sampling.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace helio {
namespace {

// Integral of the tent of radius 1 from 0 to x: odd, in [-1/2, 1/2].
double tent_integral(double x) {
  const double a = std::min(std::fabs(x), 1.0);
  return std::copysign(a - 0.5 * a * a, x);
}

double inverse_tent_integral(double c) {
  const double a = 2 * std::fabs(c);
  return std::copysign(a / (1 + std::sqrt(std::max(0.0, 1 - a))), c);
}

// The same of the Gaussian of deviation 1, lowered by its value at kEnd, in linear pieces.
class GaussianTable {
 public:
  GaussianTable() {
    const double floor = std::exp(-0.5 * kEnd * kEnd);
    for (std::size_t i = 0; i < kPieces; ++i) {
      const double x = kStep * double(i);
      density_[i] = std::exp(-0.5 * x * x) - floor;
    }
    for (std::size_t i = 0; i < kPieces; ++i) {
      integral_[i + 1] = integral_[i] + 0.5 * kStep * (density_[i] + density_[i + 1]);
    }
  }

  double integral(double x) const {
    const double a = std::min(std::fabs(x), kEnd) / kStep;
    const std::size_t i = std::min(std::size_t(a), kPieces - 1);
    const double t = (a - double(i)) * kStep;
    return std::copysign(integral_[i] + t * (density_[i] + 0.5 * slope(i) * t), x);
  }

  double density(double x) const {
    const double a = std::fabs(x) / kStep;
    const auto i = std::size_t(std::min(a, double(kPieces)));
    return i < kPieces ? density_[i] + slope(i) * (a - double(i)) * kStep : 0.0;
  }

  double inverse_integral(double c) const {
    const double wanted = std::min(std::fabs(c), integral_[kPieces]);
    const auto above = std::upper_bound(integral_.begin() + 1, integral_.end() - 1, wanted);
    const std::size_t i = std::size_t(above - integral_.begin()) - 1;
    // p t + slope t^2 / 2 = rest, solved in the form that holds where the slope is 0.
    const double rest = wanted - integral_[i], p = density_[i];
    const double t = 2 * rest / (p + std::sqrt(std::max(0.0, p * p + 2 * slope(i) * rest)));
    return std::copysign(kStep * double(i) + std::clamp(t, 0.0, kStep), c);
  }

  GaussianPieces pieces() const { return {density_, integral_}; }

  static constexpr double kEnd = 4;

 private:
  static constexpr std::size_t kPieces = 1024;
  static constexpr double kStep = kEnd / kPieces;

  double slope(std::size_t i) const { return (density_[i + 1] - density_[i]) / kStep; }

  std::array<double, kPieces + 1> density_{}, integral_{};
};

const GaussianTable& gaussian() {
  static const GaussianTable table;
  return table;
}

}  // namespace

GaussianPieces gaussian_pieces() {
  return gaussian().pieces();
}

double pixel_filter_radius(const PixelFilter& filter) {
  switch (filter.kind) {
    case PixelFilterKind::box:
      break;
    case PixelFilterKind::tent:
      return filter.scale;
    case PixelFilterKind::gaussian:
      return GaussianTable::kEnd * filter.scale;
  }
  return 0.5;
}

double pixel_filter_density(const PixelFilter& filter, double x, double low, double high) {
  if (filter.kind == PixelFilterKind::box) return x >= -0.5 && x < 0.5 ? 1.0 : 0.0;
  if (!(x >= low && x <= high)) return 0;
  const bool tent = filter.kind == PixelFilterKind::tent;
  const double at = x / filter.scale, from = low / filter.scale, to = high / filter.scale;
  if (tent) return std::max(0.0, 1 - std::fabs(at)) / ((tent_integral(to) - tent_integral(from)) * filter.scale);
  const GaussianTable& table = gaussian();
  return table.density(at) / ((table.integral(to) - table.integral(from)) * filter.scale);
}

double sample_pixel_filter(const PixelFilter& filter, double u, double low, double high) {
  if (filter.kind == PixelFilterKind::box) return u - 0.5;
  const bool tent = filter.kind == PixelFilterKind::tent;
  const auto integral = [&](double x) { return tent ? tent_integral(x) : gaussian().integral(x); };
  const double from = integral(low / filter.scale), to = integral(high / filter.scale);
  const double at = from + (to - from) * u;
  return std::clamp(filter.scale * (tent ? inverse_tent_integral(at) : gaussian().inverse_integral(at)), low, high);
}

}  // namespace helio
