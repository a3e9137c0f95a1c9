#include "renderer/comparison/ratios.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "renderer/comparison/curve.h"
#include "renderer/comparison/log_ratio.h"
#include "renderer/comparison/power_law.h"

namespace helio {
namespace {

constexpr double kSameTime = 0.05;  // relative difference of times that count as equal
constexpr double kMostApart = 0.2;  // share of seeds: an interruption leaves one of five
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

using Seeds = std::vector<std::uint32_t>;

Seeds seeds_of(const SeedTable& table, std::size_t mode, std::uint32_t budgets, PathViews views) {
  Seeds all;
  for (std::uint32_t budget = 0; budget < budgets; ++budget) {
    for (const SeedValues& seed : table.over_views(mode, budget, views)) all.push_back(seed.seed_number);
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

double log_or_nan(const std::optional<double>& value) {
  return value && *value > 0 ? std::log(*value) : kNan;
}

std::optional<double> mean_of(const LeaveOneOutMean& mean, const std::optional<std::uint32_t>& left_out) {
  return left_out ? mean.without(*left_out) : std::optional(mean.mean());
}

Verdict verdict_of(const ComparedRatio& entry) {
  const Interval& ratio = entry.ratio;
  if (!ratio.known || entry.few_pixels_decide || entry.different_calls) return Verdict::undecided;
  const bool more_is_better = entry.kind == RatioKind::equal_error;
  if (ratio.low > 1) return more_is_better ? Verdict::better : Verdict::worse;
  if (ratio.high < 1) return more_is_better ? Verdict::worse : Verdict::better;
  return Verdict::undecided;
}

// More than kMostApart of the seeds of either come from calls that those of the other do not.
bool took_no_turns(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  std::map<std::uint32_t, std::pair<double, double>> shares;
  for (const std::uint32_t call : a) shares[call].first += 1 / double(a.size());
  for (const std::uint32_t call : b) shares[call].second += 1 / double(b.size());
  double together = 0;
  for (const auto& [call, share] : shares) together += std::min(share.first, share.second);
  return together < 1 - kMostApart - 1e-9;
}

// One of the two values that a ratio is made of.
struct Side {
  LogJackknife log;
  bool few_pixels_decide = false;    // an error that it is made of
  std::vector<std::uint32_t> calls;  // of its seeds
};

Side side_of(LogJackknife log, std::initializer_list<const CurvePoint*> points) {
  Side side{std::move(log), false, {}};
  for (const CurvePoint* point : points) {
    side.few_pixels_decide |= point->few_pixels_decide;
    side.calls.insert(side.calls.end(), point->calls.begin(), point->calls.end());
  }
  return side;
}

class Pair {
 public:
  Pair(const ComparisonScript& script, const SeedTable& table, std::size_t mode, std::size_t baseline)
      : script_(script),
        table_(table),
        budgets_(std::uint32_t(script.budgets.size())),
        mode_(mode),
        baseline_(baseline),
        views_(table.views_of(mode, baseline)) {
    if (!script.common_seeds) return;
    const Seeds of_mode = seeds_of(table, mode, budgets_, views_),
                of_baseline = seeds_of(table, baseline, budgets_, views_);
    common_.emplace();
    std::set_intersection(of_mode.begin(), of_mode.end(), of_baseline.begin(), of_baseline.end(),
                          std::back_inserter(*common_));
  }

  std::vector<ComparedRatio> ratios() {
    const bool previews = table_.is_preview(mode_) || table_.is_preview(baseline_);
    if (!script_.budgets_are_seconds && !previews) speed();
    for (std::size_t key = 0; key < table_.keys().size(); ++key) {
      if (!is_error(table_.keys()[key].measure)) continue;
      key_ = table_.keys()[key];
      const Curve mode = curve(mode_, key), baseline = curve(baseline_, key);
      if (previews) {
        equal_time_of_previews(mode, baseline);
        continue;
      }
      if (!script_.budgets_are_seconds) equal_samples(mode, baseline);
      equal_time(mode, baseline);
      equal_error(mode, baseline);
    }
    return std::move(ratios_);
  }

 private:
  Curve curve(std::size_t mode, std::size_t key) const {
    return make_curve(table_, mode, key, budgets_, views_, common_ ? &*common_ : nullptr);
  }

  // means: those that log_value is made of. With too few seeds in one of them there are no values without one.
  template <class LogValue>
  LogJackknife leave_one_out(std::span<const LeaveOneOutMean* const> means, const LogValue& log_value) const {
    Seeds seeds;
    for (const LeaveOneOutMean* mean : means) {
      if (mean->seeds().size() < std::size_t(kLeastSeeds)) return jackknife({}, log_value);
      seeds.insert(seeds.end(), mean->seeds().begin(), mean->seeds().end());
    }
    std::sort(seeds.begin(), seeds.end());
    seeds.erase(std::unique(seeds.begin(), seeds.end()), seeds.end());
    return jackknife(common_ ? *common_ : seeds, log_value);
  }

  Side error_of(const CurvePoint& point) const {
    const LeaveOneOutMean* means[] = {&point.error};
    return side_of(
        leave_one_out(
            means, [&](std::optional<std::uint32_t> left_out) { return log_or_nan(mean_of(point.error, left_out)); }),
        {&point});
  }

  // On the segment's line where an error is reached.
  Side seconds_at(const CurveSegment& segment, double error) const {
    const CurvePoint &begin = *segment.begin, &end = *segment.end;
    return side_of(on_line(begin.error, begin.seconds, end.error, end.seconds, error), {&begin, &end});
  }
  Side error_at(const CurveSegment& segment, double seconds) const {
    const CurvePoint &begin = *segment.begin, &end = *segment.end;
    return side_of(on_line(begin.seconds, begin.error, end.seconds, end.error, seconds), {&begin, &end});
  }
  LogJackknife on_line(const LeaveOneOutMean& x0, const LeaveOneOutMean& y0, const LeaveOneOutMean& x1,
                       const LeaveOneOutMean& y1, double x) const {
    const LeaveOneOutMean* means[] = {&x0, &y0, &x1, &y1};
    // The line must rise or fall along x without a seed as it does with all seeds.
    const bool falling = x1.mean() < x0.mean();
    return leave_one_out(means, [&, falling](std::optional<std::uint32_t> left_out) {
      const auto a = mean_of(x0, left_out), b = mean_of(y0, left_out), c = mean_of(x1, left_out),
                 d = mean_of(y1, left_out);
      if (!(a && b && c && d && *a > 0 && *b > 0 && *c > 0 && *d > 0 && x > 0)) return kNan;
      if (*a == *c || (*c < *a) != falling) return kNan;
      return log_on_power_law(*a, *b, *c, *d, x);
    });
  }

  void add(RatioKind kind, double at, const Side& top, const Side& bottom) {
    const std::optional<Interval> ratio = log_ratio(top.log, bottom.log, common_.has_value());
    if (!ratio) return;
    ComparedRatio entry;
    entry.kind = kind;
    entry.mode = script_.modes[mode_];
    entry.baseline = script_.modes[baseline_];
    entry.measure = key_.measure;
    entry.region = key_.region;
    entry.at = at;
    entry.ratio = *ratio;
    entry.few_pixels_decide = top.few_pixels_decide || bottom.few_pixels_decide;
    entry.different_calls = kind != RatioKind::equal_samples && took_no_turns(top.calls, bottom.calls);
    entry.verdict = verdict_of(entry);
    ratios_.push_back(std::move(entry));
  }

  // Of the geometric mean.
  std::optional<Side> seconds_of(std::size_t mode, std::uint32_t budget) const {
    Seeds numbers;
    std::vector<double> logs;
    Side side;
    for (const SeedValues& seed : table_.over_views(mode, budget, views_)) {
      if (!(seed.seconds > 0)) return std::nullopt;
      if (common_ && !std::binary_search(common_->begin(), common_->end(), seed.seed_number)) continue;
      numbers.push_back(seed.seed_number);
      logs.push_back(std::log(seed.seconds));
      side.calls.push_back(seed.call);
    }
    if (numbers.empty()) return std::nullopt;
    const LeaveOneOutMean mean(numbers, logs);
    const LeaveOneOutMean* means[] = {&mean};
    side.log = leave_one_out(
        means, [&](std::optional<std::uint32_t> left_out) { return mean_of(mean, left_out).value_or(kNan); });
    return side;
  }

  void speed() {
    for (std::uint32_t budget = 0; budget < budgets_; ++budget) {
      const auto mode = seconds_of(mode_, budget), baseline = seconds_of(baseline_, budget);
      if (mode && baseline) add(RatioKind::speed, script_.budgets[budget], *mode, *baseline);
    }
  }

  void equal_samples(const Curve& mode, const Curve& baseline) {
    for (std::uint32_t budget = 0; budget < budgets_; ++budget) {
      const CurvePoint *top = mode.at_budget(budget), *bottom = baseline.at_budget(budget);
      if (top && bottom) add(RatioKind::equal_samples, script_.budgets[budget], error_of(*top), error_of(*bottom));
    }
  }

  static bool take_as_long(const CurvePoint& mode, const CurvePoint& baseline) {
    const double seconds = baseline.seconds.mean();
    return std::abs(mode.seconds.mean() - seconds) <= kSameTime * seconds;
  }

  // The seconds of previews do not follow the budgets, so their points are no curve.
  void equal_time_of_previews(const Curve& mode, const Curve& baseline) {
    const bool of_mode = table_.is_preview(mode_), of_baseline = table_.is_preview(baseline_);
    for (std::uint32_t budget = 0; budget < budgets_; ++budget) {
      const CurvePoint *top = mode.at_budget(budget), *bottom = baseline.at_budget(budget);
      if (of_mode && of_baseline) {
        if (top && bottom && take_as_long(*top, *bottom))
          add(RatioKind::equal_time, bottom->seconds.mean(), error_of(*top), error_of(*bottom));
        continue;
      }
      const CurvePoint* previews = of_mode ? top : bottom;
      if (!previews) continue;
      const double seconds = previews->seconds.mean();
      const auto other = (of_mode ? baseline : mode).enclosing_seconds(seconds);
      if (!other) continue;
      const Side of_previews = error_of(*previews), of_film = error_at(*other, seconds);
      add(RatioKind::equal_time, seconds, of_mode ? of_previews : of_film, of_mode ? of_film : of_previews);
    }
  }

  void equal_time(const Curve& mode, const Curve& baseline) {
    const auto interpolated = [&](double seconds) {
      const auto top = mode.enclosing_seconds(seconds), bottom = baseline.enclosing_seconds(seconds);
      if (top && bottom) add(RatioKind::equal_time, seconds, error_at(*top, seconds), error_at(*bottom, seconds));
    };
    for (const CurvePoint& point : baseline.points()) {
      const CurvePoint* other = mode.at_budget(point.budget);
      const double seconds = point.seconds.mean();
      if (script_.budgets_are_seconds && other && take_as_long(*other, point)) {
        add(RatioKind::equal_time, script_.budgets[point.budget], error_of(*other), error_of(point));
      } else {
        interpolated(seconds);
      }
    }
    if (script_.budgets_are_seconds || mode.joined().empty() || baseline.joined().empty()) return;
    const double of_mode = mode.joined().back().seconds.mean(), of_baseline = baseline.joined().back().seconds.mean();
    if (of_mode < of_baseline) interpolated(of_mode);
  }

  void equal_error(const Curve& mode, const Curve& baseline) {
    const auto compare = [&](double error) {
      const auto top = baseline.enclosing_error(error), bottom = mode.enclosing_error(error);
      if (top && bottom) add(RatioKind::equal_error, error, seconds_at(*top, error), seconds_at(*bottom, error));
    };
    const auto lowest = [](const Curve& curve) {
      double error = std::numeric_limits<double>::infinity();
      for (const CurvePoint& point : curve.joined()) error = std::min(error, point.error.mean());
      return error;
    };
    for (const CurvePoint& point : baseline.joined()) compare(point.error.mean());
    if (lowest(mode) > lowest(baseline)) compare(lowest(mode));
  }

  const ComparisonScript& script_;
  const SeedTable& table_;
  std::uint32_t budgets_;
  std::size_t mode_, baseline_;
  PathViews views_;
  std::optional<Seeds> common_;        // where ratios are paired: those of both
  ValueKey key_{Measure::relmse, {}};  // of speed, which has none: the measure that ComparedRatio has of itself
  std::vector<ComparedRatio> ratios_;
};

}  // namespace

std::vector<ComparedRatio> compare_modes(const ComparisonScript& script, const SeedTable& table, std::size_t mode,
                                         std::size_t baseline) {
  return Pair(script, table, mode, baseline).ratios();
}

}  // namespace helio
