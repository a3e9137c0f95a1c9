#include "tests/bench/reports/reuse_report.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "renderer/comparison/power_law.h"
#include "renderer/comparison/student_t.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/scenes/over_scenes.h"

namespace helio::bench {

namespace {

constexpr std::size_t kLeastSeeds = 3;  // for limits and standard errors
constexpr double kMostErrorOverRestart = 1.10, kMostBias = 0.2, kLeastInside = 99;
constexpr double kLeastCalibration = 0.8, kMostCalibration = 1.4;
constexpr double kMostCost[] = {25, 8};
constexpr const char* kCostNames[] = {"cost_of_one_sample", "cost_of_four_samples"};

using Curve = const ReuseCurve& (*)(const ReuseSeed&);
using Measure = double ReusePoint::*;
using OtherCost = FrameCost (OtherModes::*)[2];
const ReuseCurve& combined_of(const ReuseSeed& seed) {
  return seed.combined;
}
template <ReuseCurve OtherModes::* kCurve>
const ReuseCurve& other_of(const ReuseSeed& seed) {
  return (*seed.others).*kCurve;
}
constexpr Curve kPaper[] = {other_of<&OtherModes::paper_combined>, other_of<&OtherModes::paper_reproject>};

class Report {
 public:
  Report(const std::vector<ReuseSeed>& seeds, std::size_t points, const ReuseGoals& goals)
      : seeds_(seeds),
        points_(points),
        goals_(goals),
        others_(
            std::all_of(seeds.begin(), seeds.end(), [](const ReuseSeed& seed) { return seed.others.has_value(); })) {}

  ReuseReport make(double newly_seen) {
    if (seeds_.size() < kLeastSeeds)
      out_.notes.push_back(
          fmt::format("{} seeds, fewer than {}: no limits, no standard errors", seeds_.size(), kLeastSeeds));
    gains(newly_seen);
    errors("error_over_restart", {combined_of}, &ReusePoint::relmse, kMostErrorOverRestart);
    if (others_) {
      errors("paper_error_over_restart", {kPaper[0], kPaper[1]}, &ReusePoint::relmse, std::nullopt);
    }
    at_point("at_two", 1);  // a single sample has no second half everywhere
    at_point("at_last", points_ - 1);
    if (others_) costs();
    dark_half();
    add("carried", median(of_seeds([](const ReuseSeed& s) { return 100 * s.combined.points[0].carried; })), "%",
        Better::higher);
    if (others_) add("paper_bias", worse_paper_bias(), "%", Better::within);
    return std::move(out_);
  }

 private:
  void add(const std::string& name, double value, const char* unit, Better better,
           std::optional<double> goal = std::nullopt, std::optional<double> median_goal = std::nullopt) {
    out_.figures.push_back({{name, value, unit, goal, better}, median_goal});
  }
  void add_within(const std::string& name, double value, const char* unit, double least, double most) {
    out_.figures.push_back({{name, value, unit, most, Better::within, least}, std::nullopt});
  }
  std::vector<double> of_seeds(const std::function<double(const ReuseSeed&)>& value) const {
    std::vector<double> values;
    for (const ReuseSeed& seed : seeds_) values.push_back(value(seed));
    return values;
  }

  const ReusePoint& restart_goal(const ReuseSeed& seed) const { return seed.restart.points[points_ - 1]; }

  // Of the restart's time to its error over the curve's to the same: at most that where it is not reached.
  double gain_at_most(const ReuseSeed& seed, Curve curve, Measure error) const {
    const ReusePoint& goal = restart_goal(seed);
    return goal.seconds / time_to(curve(seed), error, goal.*error).seconds;
  }
  // Ours: 0 where it is not reached, and a note.
  std::vector<double> gains_at_least(Curve curve, Measure error, const std::string& name) {
    std::vector<double> gains;
    std::size_t missed = 0;
    double bound = 0;
    for (const ReuseSeed& seed : seeds_) {
      const bool reached = time_to(curve(seed), error, restart_goal(seed).*error).reached;
      const double most = gain_at_most(seed, curve, error);
      gains.push_back(reached ? most : 0);
      missed += !reached;
      if (!reached) bound = std::max(bound, most);
    }
    if (missed > 0)
      out_.notes.push_back(
          fmt::format("{}: {} of {} seeds did not reach the restart's error, which counts as no gain; "
                      "it is below {:.3g}x",
                      name, missed, seeds_.size(), bound));
    return gains;
  }

  void gains(double newly_seen) {
    const auto combined = gains_at_least(combined_of, &ReusePoint::relmse, "combined_over_restart");
    add("combined_over_restart", median(combined), "x", Better::higher, goals_.worst_gain, goals_.median_gain);
    if (others_) gains_of_others(combined);
    add("newly_seen", 100 * newly_seen, "%", Better::lower);
    if (newly_seen <= 0) {
      out_.notes.push_back("nothing is newly seen: there is no ceiling");
      return;
    }
    add("ceiling", 1 / newly_seen, "x", Better::higher);
    add("share_of_ceiling", 100 * median(combined) * newly_seen, "%", Better::higher, goals_.share_of_ceiling);
  }

  // `combined`: our gains, by seed.
  void gains_of_others(const std::vector<double>& combined) {
    const auto reproject =
        gains_at_least(other_of<&OtherModes::reproject>, &ReusePoint::relmse, "reproject_over_restart");
    add("reproject_over_restart", median(reproject), "x", Better::higher);
    std::vector<double> paper[2], over_paper;
    std::size_t missed = 0;
    for (std::size_t i = 0; i < seeds_.size(); ++i) {
      for (int k = 0; k < 2; ++k) {
        paper[k].push_back(gain_at_most(seeds_[i], kPaper[k], &ReusePoint::relmse));
        missed += !time_to(kPaper[k](seeds_[i]), &ReusePoint::relmse, restart_goal(seeds_[i]).relmse).reached;
      }
      over_paper.push_back(combined[i] / std::max(paper[0].back(), paper[1].back()));
    }
    add("paper_combined_over_restart", median(paper[0]), "x", Better::higher);
    add("paper_reproject_over_restart", median(paper[1]), "x", Better::higher);
    add("combined_over_paper", median(over_paper), "x", Better::higher, goals_.over_paper);
    if (missed > 0)
      out_.notes.push_back(
          fmt::format("paper: {} of {} runs did not reach the restart's error: their gains are upper "
                      "bounds, combined_over_paper is a lower one",
                      missed, 2 * seeds_.size()));
  }

  // Over the restart's at equal time, at each count: the largest of means over seeds, and of their upper limits; of the
  // curves given the worst.
  void errors(const std::string& name, const std::vector<Curve>& curves, Measure error, std::optional<double> goal) {
    double high = 0;
    std::vector<double> means(points_);
    for (const Curve curve : curves) {
      for (std::size_t k = 0; k < points_; ++k) {
        const auto ratios = of_seeds([&](const ReuseSeed& seed) {
          const ReusePoint& point = curve(seed).points[k];
          return point.*error / error_at(seed.restart, error, point.seconds);
        });
        const MeanRatio ratio = mean_ratio(ratios);
        means[k] = std::max(means[k], ratio.mean);
        high = std::max(high, ratio.high);
      }
    }
    add(name, *std::max_element(means.begin(), means.end()), "x", Better::lower);
    for (std::size_t k = 0; k < points_ && goal; ++k)
      add(fmt::format("{}.at_{}", name, 1u << k), means[k], "x", Better::lower);
    if (goal && seeds_.size() >= kLeastSeeds) add(name + ".upper_95", high, "x", Better::lower, goal);
  }

  // Mean over seeds of the difference to the restart's longest picture; both have the reference's own error.
  void add_bias(const std::string& name, std::size_t point, double ReusePoint::* bias, bool against_bound) {
    const std::vector<double> off = of_seeds([&](const ReuseSeed& seed) {
      return 100 * (seed.combined.points[point].*bias - seed.restart.points.back().*bias);
    });
    const double mean = mean_of(off);
    if (!std::isfinite(mean)) return;  // half of the picture is black
    const bool judged = seeds_.size() >= kLeastSeeds;
    if (judged && against_bound) {
      add_within(name, mean, "%", -kMostBias, kMostBias);
    } else {
      add_within(name, mean, "%", 0, 0);
      out_.figures.back().figure.goal.reset();
    }
    if (!judged) return;
    const double error = standard_error(off);
    add(name + ".standard_error", error, "%", Better::lower);
    if (!against_bound) return;
    double bound = 0;
    for (const ReuseSeed& seed : seeds_) bound += 100 * seed.combined.points[point].bound / double(seeds_.size());
    add(name + ".bound", bound, "%", Better::lower);
    const double beyond = std::max(0.0, std::abs(mean) - bound);
    add(name + ".beyond_bound", beyond > 0 ? beyond / error : 0.0, "s.e.", Better::lower, 3.0);
  }

  // Of seeds whose true error is not mostly the reference's.
  void calibration(const std::string& name, std::size_t k) {
    std::vector<double> ratios;
    for (const ReuseSeed& seed : seeds_) {
      const ReusePoint& point = seed.combined.points[k];
      if (point.relmse >= point.noise) ratios.push_back(std::sqrt(point.reported / point.relmse));
    }
    if (ratios.size() < seeds_.size())
      out_.notes.push_back(fmt::format("{}: the reference's noise is most of the error of {} of {} seeds, left out",
                                       name, seeds_.size() - ratios.size(), seeds_.size()));
    if (ratios.empty()) return;
    add_within(name, median(ratios), "x", kLeastCalibration, kMostCalibration);
    add_within(name + ".worst_seed", worst_of(ratios, out_.figures.back().figure), "x", kLeastCalibration,
               kMostCalibration);
  }

  void at_point(const std::string& name, std::size_t k) {
    calibration(name + ".reported_over_true", k);
    add(name + ".within_three", median(of_seeds([k](const ReuseSeed& s) { return 100 * s.combined.points[k].inside; })),
        "%", Better::higher, kLeastInside);
    add(name + ".pixels_within_three",
        median(of_seeds([k](const ReuseSeed& s) { return 100 * s.combined.points[k].pixels_inside; })), "%",
        Better::higher, kLeastInside);
    add_bias(name + ".bias", k, &ReusePoint::bias, true);
  }

  void costs() {
    for (int k = 0; k < 2; ++k) {
      const auto frame = [this, k](OtherCost cost) {
        return median(of_seeds([k, cost](const ReuseSeed& seed) {
          return 100 * (((*seed.others).*cost)[k].all / seed.others->restart_cost[k].all - 1);
        }));
      };
      const std::string name = kCostNames[k];
      add(name + ".passes", median(of_seeds([k](const ReuseSeed& seed) {
            return 100 * seed.others->combined_cost[k].reuse / seed.others->restart_cost[k].all;
          })),
          "%", Better::lower, kMostCost[k]);
      add(name + ".frame", frame(&OtherModes::combined_cost), "%", Better::lower, kMostCost[k]);
      add("paper_combined_" + name + ".frame", frame(&OtherModes::paper_combined_cost), "%", Better::lower);
      add("paper_reproject_" + name + ".frame", frame(&OtherModes::paper_reproject_cost), "%", Better::lower);
    }
  }

  void dark_half() {
    const bool black = std::any_of(seeds_.begin(), seeds_.end(), [](const ReuseSeed& seed) {
      return !std::isfinite(seed.restart.points[0].dark_relmse);
    });
    if (black) {
      out_.notes.push_back("half of the reference is black: no figures of a dark half");
      return;
    }
    add("dark.combined_over_restart",
        median(gains_at_least(combined_of, &ReusePoint::dark_relmse, "dark.combined_over_restart")), "x",
        Better::higher);
    errors("dark.error_over_restart", {combined_of}, &ReusePoint::dark_relmse, std::nullopt);
    add_bias("dark.at_two.bias", 1, &ReusePoint::dark_bias, false);
    add_bias("dark.at_last.bias", points_ - 1, &ReusePoint::dark_bias, false);
  }

  double worse_paper_bias() const {
    double worse = 0;
    for (const Curve curve : kPaper) {
      const double off = median(of_seeds([&](const ReuseSeed& seed) {
        return 100 * (curve(seed).points[points_ - 1].bias - seed.restart.points.back().bias);
      }));
      if (std::abs(off) > std::abs(worse)) worse = off;
    }
    return worse;
  }

  const std::vector<ReuseSeed>& seeds_;
  std::size_t points_;
  const ReuseGoals& goals_;
  const bool others_;  // are known
  ReuseReport out_;
};

}  // namespace

TimeToError time_to(const ReuseCurve& curve, double ReusePoint::* error, double target) {
  const std::vector<ReusePoint>& points = curve.points;
  if (points.front().*error <= target) return {points.front().seconds, true};
  for (std::size_t i = 1; i < points.size(); ++i) {
    const ReusePoint &a = points[i - 1], &b = points[i];
    if (b.*error > target) continue;
    return {std::exp(log_on_power_law(a.*error, a.seconds, b.*error, b.seconds, target)), true};
  }
  return {points.back().seconds, false};
}

double error_at(const ReuseCurve& curve, double ReusePoint::* error, double seconds) {
  const std::vector<ReusePoint>& points = curve.points;
  if (seconds <= points.front().seconds) return points.front().*error;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const ReusePoint &a = points[i - 1], &b = points[i];
    if (b.seconds < seconds) continue;
    return std::exp(log_on_power_law(a.seconds, a.*error, b.seconds, b.*error, seconds));
  }
  return points.back().*error * points.back().seconds / seconds;
}

MeanRatio mean_ratio(const std::vector<double>& ratios) {
  std::vector<double> logs;
  for (const double ratio : ratios) logs.push_back(std::log(ratio));
  const double mean = mean_of(logs);
  if (logs.size() < 2) return {std::exp(mean), std::numeric_limits<double>::infinity()};
  return {std::exp(mean), std::exp(mean + student_t_95(int(logs.size()) - 1) * standard_error(logs))};
}

ReuseReport report_reuse(const std::vector<ReuseSeed>& seeds, std::size_t points, double newly_seen,
                         const ReuseGoals& goals) {
  return Report(seeds, points, goals).make(newly_seen);
}

}  // namespace helio::bench
