// One mode's error against time, as means over seeds, and the same means without one of the seeds.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "renderer/comparison/seed_values.h"

namespace helio {

// The mean of one quantity, and its means without one seed each.
class LeaveOneOutMean {
 public:
  LeaveOneOutMean() = default;
  // Seeds by rising number, not empty.
  LeaveOneOutMean(std::vector<std::uint32_t> seeds, std::span<const double> values);

  double mean() const { return mean_; }
  // Without that seed; the mean of all where it is not among them. None where it is the only one.
  std::optional<double> without(std::uint32_t seed) const;
  const std::vector<std::uint32_t>& seeds() const { return seeds_; }

 private:
  std::vector<std::uint32_t> seeds_;
  double mean_ = 0;
  std::vector<double> without_;  // empty for one seed
};

struct CurvePoint {
  std::uint32_t budget = 0;
  LeaveOneOutMean seconds, error;
  bool few_pixels_decide = false;    // the error (few_pixels.h)
  std::vector<std::uint32_t> calls;  // of the seeds
};

// A piece of a curve, straight in logarithms.
struct CurveSegment {
  const CurvePoint *begin = nullptr, *end = nullptr;  // as long as the curve lives
};

class Curve {
 public:
  // points: by rising budget, of the seeds that have the error.
  explicit Curve(std::vector<CurvePoint> points);

  const std::vector<CurvePoint>& points() const { return points_; }
  const CurvePoint* at_budget(std::uint32_t budget) const;

  // The first segments that enclose a time or an error. Only those points are joined that come before the first without
  // a positive error, whose logarithm does not exist, and whose times rise.
  std::optional<CurveSegment> enclosing_seconds(double seconds) const;
  std::optional<CurveSegment> enclosing_error(double error) const;

  // Points that are joined; by rising time.
  std::span<const CurvePoint> joined() const { return joined_; }

 private:
  std::vector<CurvePoint> points_, joined_;
};

// The curve of one mode and measure, of means over `views`; `seeds`, where given, are the only ones that count.
Curve make_curve(const SeedTable& table, std::size_t mode, std::size_t key, std::uint32_t budgets, PathViews views,
                 const std::vector<std::uint32_t>* seeds = nullptr);

}  // namespace helio
