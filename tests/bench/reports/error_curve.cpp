#include "tests/bench/reports/error_curve.h"

#include <cmath>

#include "renderer/comparison/curve.h"
#include "renderer/comparison/power_law.h"

namespace helio::bench {

std::optional<double> time_to(const std::vector<CurvePoint>& curve, double target) {
  const auto of_one_seed = [](double value) { return LeaveOneOutMean({1}, {&value, 1}); };
  std::vector<helio::CurvePoint> points;
  for (const CurvePoint& point : curve)
    points.push_back({std::uint32_t(points.size()), of_one_seed(point.seconds), of_one_seed(point.error)});
  const Curve joined(std::move(points));
  const auto around = joined.enclosing_error(target);
  if (!around) return std::nullopt;
  const helio::CurvePoint &a = *around->begin, &b = *around->end;
  return std::exp(log_on_power_law(a.error.mean(), a.seconds.mean(), b.error.mean(), b.seconds.mean(), target));
}

}  // namespace helio::bench
