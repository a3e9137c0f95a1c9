#include "renderer/comparison/curve.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "renderer/comparison/few_pixels.h"

namespace helio {

LeaveOneOutMean::LeaveOneOutMean(std::vector<std::uint32_t> seeds, std::span<const double> values)
    : seeds_(std::move(seeds)) {
  // Sums of all before and all behind a seed: to take one value off the sum of all would leave nothing of small ones.
  const std::size_t n = values.size();
  std::vector<double> behind(n + 1, 0.0);
  for (std::size_t i = n; i-- > 0;) behind[i] = behind[i + 1] + values[i] / double(n);
  mean_ = behind[0];
  if (n < 2) return;
  double before = 0;
  for (std::size_t i = 0; i < n; ++i) {
    without_.push_back((before + behind[i + 1]) * (double(n) / double(n - 1)));
    before += values[i] / double(n);
  }
}

std::optional<double> LeaveOneOutMean::without(std::uint32_t seed) const {
  const auto found = std::lower_bound(seeds_.begin(), seeds_.end(), seed);
  if (found == seeds_.end() || *found != seed) return mean_;
  if (without_.empty()) return std::nullopt;
  return without_[std::size_t(found - seeds_.begin())];
}

Curve::Curve(std::vector<CurvePoint> points) : points_(std::move(points)) {
  for (const CurvePoint& point : points_) {
    if (!(point.error.mean() > 0)) break;
    const double before = joined_.empty() ? 0 : joined_.back().seconds.mean();
    if (point.seconds.mean() > before) joined_.push_back(point);
  }
}

const CurvePoint* Curve::at_budget(std::uint32_t budget) const {
  for (const CurvePoint& point : points_) {
    if (point.budget == budget) return &point;
  }
  return nullptr;
}

std::optional<CurveSegment> Curve::enclosing_seconds(double seconds) const {
  for (std::size_t i = 0; i + 1 < joined_.size(); ++i) {
    if (joined_[i].seconds.mean() <= seconds && seconds <= joined_[i + 1].seconds.mean())
      return CurveSegment{&joined_[i], &joined_[i + 1]};
  }
  return std::nullopt;
}

std::optional<CurveSegment> Curve::enclosing_error(double error) const {
  for (std::size_t i = 0; i + 1 < joined_.size(); ++i) {
    const double begin = joined_[i].error.mean(), end = joined_[i + 1].error.mean();
    if (begin >= error && error >= end && begin > end) return CurveSegment{&joined_[i], &joined_[i + 1]};
  }
  return std::nullopt;
}

Curve make_curve(const SeedTable& table, std::size_t mode, std::size_t key, std::uint32_t budgets, PathViews views,
                 const std::vector<std::uint32_t>* seeds) {
  std::vector<CurvePoint> points;
  for (std::uint32_t budget = 0; budget < budgets; ++budget) {
    std::vector<std::uint32_t> numbers;
    std::vector<double> seconds, errors;
    std::vector<const SeedValues*> seeds_with_it;
    std::vector<std::uint32_t> calls;
    for (const SeedValues& seed : table.over_views(mode, budget, views)) {
      if (!seed.values[key]) continue;
      if (seeds && !std::binary_search(seeds->begin(), seeds->end(), seed.seed_number)) continue;
      numbers.push_back(seed.seed_number);
      seconds.push_back(seed.seconds);
      errors.push_back(*seed.values[key]);
      seeds_with_it.push_back(&seed);
      calls.push_back(seed.call);
    }
    if (numbers.empty()) continue;
    points.push_back({budget, LeaveOneOutMean(numbers, seconds), LeaveOneOutMean(numbers, errors),
                      few_pixels_decide(seeds_with_it, table.keys(), key), std::move(calls)});
  }
  return Curve(std::move(points));
}

}  // namespace helio
