#include "renderer/comparison/student_t.h"

#include <array>
#include <atomic>
#include <cmath>
#include <numbers>

namespace helio {
namespace {

// From here on the first terms of the expansion in 1 / freedom are closer than 1e-6.
constexpr int kExpandedFrom = 200;

// The integral of cos^power from 0 to `end`.
double integrate_cosine_power(int power, double end) {
  constexpr int kIntervals = 1000;
  const double step = end / kIntervals;
  double sum = 1 + std::pow(std::cos(end), power);
  for (int i = 1; i < kIntervals; ++i) sum += (i % 2 ? 4 : 2) * std::pow(std::cos(i * step), power);
  return sum * step / 3;
}

double bisect(int freedom) {
  double low = 0, high = std::numbers::pi / 2;
  const double target = 0.95 * integrate_cosine_power(freedom - 1, high);
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (integrate_cosine_power(freedom - 1, middle) < target ? low : high) = middle;
  }
  return std::sqrt(double(freedom)) * std::tan(low);
}

// Cornish and Fisher's expansion about the quantile of the normal distribution.
double expand(int freedom) {
  constexpr double z = 1.959963984540054;
  const double n = freedom;
  return z + (std::pow(z, 3) + z) / (4 * n) + (5 * std::pow(z, 5) + 16 * std::pow(z, 3) + 3 * z) / (96 * n * n);
}

}  // namespace

double student_t_95(int freedom) {
  if (freedom >= kExpandedFrom) return expand(freedom);
  // Two threads that find no value compute the same one.
  static std::array<std::atomic<double>, kExpandedFrom> known{};
  std::atomic<double>& quantile = known[std::size_t(freedom)];
  double value = quantile.load(std::memory_order_relaxed);
  if (value == 0) quantile.store(value = bisect(freedom), std::memory_order_relaxed);
  return value;
}

}  // namespace helio
