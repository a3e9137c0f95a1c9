// What `helio_bench reuse` says of one motion in one scene, from what every seed has measured.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/bench/reports/figures.h"
#include "tests/bench/scenes/reuse_motions.h"

namespace helio::bench {

// The last view at so many samples, against its reference; errors less what the reference's noise adds to them.
struct ReusePoint {
  double seconds = 0;  // since the view came
  double relmse = 0, dark_relmse = 0;
  double noise = 0;                // of the reference, that was taken off relmse
  double reported = 0;             // relMSE, as the picture's own variance has it
  double inside = 0;               // share of the channels within three reported standard errors
  double pixels_inside = 0;        // of the pixels, by the mean over their channels of both
  double bias = 0, dark_bias = 0;  // mean(x - r) / mean(r), with what the reference is off by
  double bound = 0;                // mean of the pixels' bias bounds, over mean(r)
  double carried = 0;              // share of the effective samples
};

struct ReuseCurve {
  std::vector<ReusePoint> points;  // at 1, 2, 4, ... samples
};

// Processor seconds of one frame: of the passes that only modes which reuse pictures have, and of all of it.
struct FrameCost {
  double reuse = 0, all = 0;
};

inline constexpr int kCostCounts[] = {1, 4};  // samples of the frames whose costs are compared

// What stands beside ours.
struct OtherModes {
  ReuseCurve reproject, paper_combined, paper_reproject;
  FrameCost restart_cost[2], combined_cost[2], paper_combined_cost[2], paper_reproject_cost[2];  // by kCostCounts
};

struct ReuseSeed {
  // The restart goes on to twice the samples, so that ours, if slower, is not held against an earlier picture of it;
  // ours goes on where it has not reached the restart's error.
  ReuseCurve restart, combined;
  std::optional<OtherModes> others;
};

// Time to an error: exact, or a bound where the curve begins below it or ends above it.
struct TimeToError {
  double seconds = 0;
  bool reached = true;  // else it takes longer
};

// Between two points as a power of time; a curve that begins below has it with its first point.
TimeToError time_to(const ReuseCurve& curve, double ReusePoint::* error, double target);
// Error at a time, likewise; before its first point that of the first, after its last one as 1 / time.
double error_at(const ReuseCurve& curve, double ReusePoint::* error, double seconds);

// Geometric mean of positive ratios, and the upper end of its interval of 95 % (Student's t of the logarithms; infinity
// for one ratio). The intervals of renderer/comparison begin at five seeds; runs of reuse take so long that three have
// to do.
struct MeanRatio {
  double mean = 0, high = 0;
};
MeanRatio mean_ratio(const std::vector<double>& ratios);

struct ReuseFigure {
  Figure figure;  // named without scene and motion
  std::optional<double> median_goal;
};

struct ReuseReport {
  std::vector<ReuseFigure> figures;
  std::vector<std::string> notes;  // what is left out, or a bound
};

// `points`: of the curves of ours, up to the samples asked for. `newly_seen`: newly_seen_share(). Precondition: seeds,
// each with restarts of points + 1 points, others of at least `points` >= 3. Unless all have the other modes
// there are no figures of those.
ReuseReport report_reuse(const std::vector<ReuseSeed>& seeds, std::size_t points, double newly_seen,
                         const ReuseGoals& goals);

}  // namespace helio::bench
