#include "renderer/comparison/log_ratio.h"

#include <algorithm>

#include "renderer/base/check.h"
#include "renderer/comparison/student_t.h"

namespace helio {
namespace {

double jackknife_variance(const std::vector<double>& without) {
  const double n = double(without.size());
  double sum = 0, squares = 0;
  for (const double v : without) sum += v;
  for (const double v : without) squares += (v - sum / n) * (v - sum / n);
  return (n - 1) / n * squares;
}

}  // namespace

std::optional<Interval> log_ratio(const LogJackknife& top, const LogJackknife& bottom, bool paired) {
  const double log = top.whole - bottom.whole, ratio = std::exp(log);
  if (!(ratio > 0 && std::isfinite(ratio))) return std::nullopt;
  const std::size_t fewest = std::min(top.without.size(), bottom.without.size());
  if (fewest < std::size_t(kLeastSeeds)) return Interval{ratio};

  double variance = 0, freedom = 0;
  if (paired) {
    HELIO_CHECK(top.without.size() == bottom.without.size());
    std::vector<double> differences = top.without;
    for (std::size_t i = 0; i < differences.size(); ++i) differences[i] -= bottom.without[i];
    variance = jackknife_variance(differences);
    freedom = double(differences.size() - 1);
  } else {
    const double of_top = jackknife_variance(top.without), of_bottom = jackknife_variance(bottom.without);
    variance = of_top + of_bottom;
    // Shares of the variance, so that no square of a small one vanishes.
    const double share = variance > 0 ? of_top / variance : 0.5;
    freedom = 1 / (share * share / double(top.without.size() - 1) +
                   (1 - share) * (1 - share) / double(bottom.without.size() - 1));
  }
  if (!std::isfinite(variance)) return Interval{ratio};
  const double half = variance > 0 ? student_t_95(std::max(1, int(freedom + 1e-6))) * std::sqrt(variance) : 0;
  const Interval interval{ratio, ratio * std::exp(-half), ratio * std::exp(half), true};
  return interval.low > 0 && std::isfinite(interval.high) ? interval : Interval{ratio};
}

}  // namespace helio
