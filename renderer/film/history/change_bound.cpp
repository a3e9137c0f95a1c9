#include "renderer/film/history/change_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace helio {
namespace {

constexpr int kRadius = 3, kNearRadius = 1;
constexpr int kBinSide = 4, kBinRadius = 2;  // cells, bins
constexpr double kSamplesFromFar = 24;
constexpr double kMostChange2 = 1.0 / 16;  // of the mean square of the radiance
constexpr double kDeviations = 1, kNearDeviations = 2;
// Differences below this share of the radiance are rounding: of rays that were traced in other company.
constexpr double kRounding = 1e-3f;

constexpr double kLargest = 1e30;  // of a mean square

double mean_product(const Rgb& a, const Rgb& b) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) sum += double(a[c]) * double(b[c]);
  return std::isfinite(sum) ? std::clamp(sum / 3, -kLargest, kLargest) : sum;
}

}  // namespace

ChangeBound::ChangeBound(int columns, int rows)
    : columns_(columns),
      rows_(rows),
      bin_columns_((columns + kBinSide - 1) / kBinSide),
      bin_rows_((rows + kBinSide - 1) / kBinSide),
      cells_(std::size_t(columns) * std::size_t(rows)) {}

void ChangeBound::set(int x, int y, const Rgb (&before)[kHalves], const Rgb (&after)[kHalves]) {
  Cell cell;
  const Rgb change[kHalves] = {after[0] - before[0], after[1] - before[1]};
  double power = 0, squares = 0;
  for (int h = 0; h < kHalves; ++h) {
    const double own = (mean_product(before[h], before[h]) + mean_product(after[h], after[h])) / 2;
    const double square = mean_product(change[h], change[h]);
    power += own / kHalves;
    squares += square / kHalves;
    cell.changed += square > kRounding * kRounding * own;
  }
  const double product = mean_product(change[0], change[1]);
  if (!std::isfinite(power) || !std::isfinite(squares) || !std::isfinite(product)) return;
  cell.product = float(product);
  cell.squares = float(squares);
  cell.power = float(power);
  cell.known = 1;
  cells_[std::size_t(y) * std::size_t(columns_) + std::size_t(x)] = cell;
}

void ChangeBound::Sums::add(const Cell& cell) {
  product += double(cell.product);
  squares += double(cell.squares);
  power += double(cell.power);
  n += cell.known;
}

void ChangeBound::Sums::add(const Sums& sums) {
  product += sums.product;
  squares += sums.squares;
  power += sums.power;
  n += sums.n;
}

void ChangeBound::finish() {
  bins_.assign(std::size_t(bin_columns_) * std::size_t(bin_rows_), {});
  double changed = 0;
  for (int y = 0; y < rows_; ++y) {
    for (int x = 0; x < columns_; ++x) {
      const Cell& cell = cells_[std::size_t(y) * std::size_t(columns_) + std::size_t(x)];
      bins_[std::size_t(y / kBinSide) * std::size_t(bin_columns_) + std::size_t(x / kBinSide)].add(cell);
      changed += cell.changed;
    }
  }
  Sums whole;
  for (const Sums& bin : bins_) whole.add(bin);
  changed_share_ = (changed + 1) / (kHalves * whole.n + 1);
  mean_power_ = whole.n > 0 ? whole.power / whole.n : 0;
}

ChangeBound::Sums ChangeBound::sum_around(int x, int y, int radius) const {
  Sums sums;
  for (int cy = std::max(y - radius, 0); cy <= std::min(y + radius, rows_ - 1); ++cy) {
    for (int cx = std::max(x - radius, 0); cx <= std::min(x + radius, columns_ - 1); ++cx)
      sums.add(cells_[std::size_t(cy) * std::size_t(columns_) + std::size_t(cx)]);
  }
  return sums;
}

ChangeBound::Sums ChangeBound::sum_far_around(int x, int y) const {
  Sums sums;
  const int bx = x / kBinSide, by = y / kBinSide;
  for (int cy = std::max(by - kBinRadius, 0); cy <= std::min(by + kBinRadius, bin_rows_ - 1); ++cy) {
    for (int cx = std::max(bx - kBinRadius, 0); cx <= std::min(bx + kBinRadius, bin_columns_ - 1); ++cx)
      sums.add(bins_[std::size_t(cy) * std::size_t(bin_columns_) + std::size_t(cx)]);
  }
  return sums;
}

double ChangeBound::squared(int x, int y) const {
  const Sums around = sum_around(x, y, kRadius);
  if (around.n == 0) return std::numeric_limits<double>::infinity();
  const Sums far = sum_far_around(x, y);
  const double samples = kHalves * around.n;
  const double power = (kHalves * around.power + mean_power_) / (samples + 1);
  const double squares_far = (kHalves * far.squares + changed_share_ * power) / (kHalves * far.n + 1);
  const double squares = (kHalves * around.squares + kSamplesFromFar * squares_far) / (samples + kSamplesFromFar);
  const double product = std::max(around.product / around.n, 0.0);
  const double noise = std::max(squares - product, 0.0);
  const auto deviation = [&](double of, double n) { return std::sqrt((noise * noise + 2 * of * noise) / n); };
  double bound = product + kDeviations * deviation(product, around.n);
  for (const int radius : {0, kNearRadius}) {
    const Sums near = sum_around(x, y, radius);
    if (near.n == 0) continue;
    const double here = std::max(near.product / near.n, 0.0);
    bound = std::max(bound, here - kNearDeviations * deviation(here, near.n));
  }
  return bound > kMostChange2 * power ? std::numeric_limits<double>::infinity() : bound;
}

}  // namespace helio
