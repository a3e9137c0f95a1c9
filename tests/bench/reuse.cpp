// What reuse is worth after a camera move: time to the error that a restart has at a given number of samples.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "camera_paths.h"
#include "error_scenes.h"
#include "newly_seen.h"
#include "renderer/metrics/error_metrics.h"
#include "scene_depth.h"
#include "statistics.h"
#include "subcommands.h"
#include "tests/support/loop_views.h"

namespace helio::bench {

namespace {

using test::LoopViews;
using test::ViewPicture;

constexpr std::uint32_t kRest = 256, kSamplesPerStep = 64;

// What happens before the last view, which is the scene's own and the one that is measured.
struct Motion {
  std::string name;
  std::vector<CameraPose> before;
  std::uint32_t samples = kRest;  // of each of these
  std::optional<double> goal;     // on the median over the scenes of restart's time over ours
  std::optional<double> goal_of_ceiling;  // on the same as a share of what lossless reuse would gain, per cent
};

struct Point {
  double seconds = 0, relmse = 0, reported = 0, inside = 0, mean = 0, share = 0;
};

// Cumulative points of the last view at 1, 2, 4, ... samples.
struct Curve {
  std::vector<Point> points;
  double reproject_seconds = 0;  // processor time
};

double mean_of_picture(const ViewPicture& picture) {
  double sum = 0;
  for (const auto& channel : picture.radiance) sum = std::accumulate(channel.begin(), channel.end(), sum);
  return sum / (3.0 * double(picture.samples.size()));
}

// Share of the pixels' channels that lie within three of the standard errors that they and the reference report.
double share_inside(const ViewPicture& picture, const ErrorScene& scene) {
  std::size_t inside = 0;
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < picture.samples.size(); ++i) {
      const double off = double(picture.radiance[c][i]) - double(scene.reference.channels[c][i]);
      inside += off * off <= 9 * (double(picture.variance[c][i]) + double(scene.reference_variance.channels[c][i]));
    }
  }
  return double(inside) / (3.0 * double(picture.samples.size()));
}

Result<Curve> run(RenderEngine& engine, const ErrorScene& scene, RenderSettings settings, RenderMode mode,
                  const Motion& motion, std::uint32_t most, ModeVariant variant = ModeVariant::bounded) {
  settings.mode = mode;
  settings.variant = variant;
  if (variant == ModeVariant::paper) settings.adaptive.min_samples = kPaperMinSamples;
  Curve curve;
  LoopViews views(engine, scene.scene, settings);
  if (reuses(mode)) {
    for (const CameraPose& pose : motion.before) views.render(pose, motion.samples);
  }
  const double noise = reference_relmse(scene);
  double seconds = 0;
  for (std::uint32_t n = 1; n <= most; n *= 2) {
    const ViewPicture& picture = views.render(scene.view, n);
    if (picture.end.reason != FrameEndReason::samples)
      return Error{ErrorCode::internal, std::string("a frame ended by ") + to_string(picture.end.reason), scene.name};
    seconds += picture.seconds;
    const auto error = relative_error(picture.view(), scene.reference.view());
    if (!error) return error.error();
    // Less what the reference's noise has added, as far as that leaves something.
    const double relmse = std::max(error->relmse - noise, 0.01 * error->relmse);
    curve.points.push_back({seconds, relmse, picture.end.progress.error.relmse, share_inside(picture, scene),
                            mean_of_picture(picture), picture.end.progress.reuse_share});
    if (n > 1) continue;
    for (const PassTime& pass : picture.end.passes) {
      if (pass.pass == "reproject") curve.reproject_seconds = pass.seconds;
    }
  }
  return curve;
}

// Seconds until the curve's error is `relmse`, between its points as a power of time; its last time where that is not
// reached, its first where it begins below.
double seconds_to(const Curve& curve, double relmse) {
  const std::vector<Point>& points = curve.points;
  if (points.front().relmse <= relmse) return points.front().seconds;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Point &a = points[i - 1], &b = points[i];
    if (b.relmse > relmse) continue;
    const double t = std::log(a.relmse / relmse) / std::log(a.relmse / b.relmse);
    return a.seconds * std::pow(b.seconds / a.seconds, t);
  }
  return points.back().seconds;
}

// Error of a curve at a time, as above; beyond its ends that of the end.
double error_at(const Curve& curve, double seconds) {
  const std::vector<Point>& points = curve.points;
  if (seconds <= points.front().seconds) return points.front().relmse;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Point &a = points[i - 1], &b = points[i];
    if (b.seconds < seconds) continue;
    const double t = std::log(seconds / a.seconds) / std::log(b.seconds / a.seconds);
    return a.relmse * std::pow(b.relmse / a.relmse, t);
  }
  return points.back().relmse;
}

std::vector<Motion> motions(const ErrorScene& scene, double depth) {
  std::vector<Motion> all;
  const auto along = [&](const char* path, const char* name, std::size_t steps, std::uint32_t samples,
                         std::optional<double> goal, std::optional<double> goal_of_ceiling = std::nullopt) {
    std::vector<CameraPose> views = views_of(*find_camera_path(path, depth), scene.view);
    views.pop_back();
    if (views.size() > steps) views.erase(views.begin(), views.end() - std::ptrdiff_t(steps));
    all.push_back({name, std::move(views), samples, goal, goal_of_ceiling});
  };
  along("turn-5", "turn_5", 1, kRest, 8.0);
  along("turn-5", "path_5", 20, kSamplesPerStep, std::nullopt, 70.0);
  along("translate", "translate", 1, kRest, 5.0);
  along("jump", "jump", 1, kRest, std::nullopt);
  return all;
}

// Of one motion, an entry for each seed.
struct Results {
  std::vector<double> paper_combined, paper_reproject, paper_worst, paper_bias;
  std::vector<double> combined, reproject, worst, cost_one, cost_four, calibration[2], inside[2], bias, share;

  // The restart goes on to twice the samples, so that ours, if slower, is not held against an earlier picture of it.
  void add(const Curve& ours, const Curve& restart, int threads) {
    const Point &goal = restart.points[ours.points.size() - 1], &last = ours.points.back();
    combined.push_back(goal.seconds / seconds_to(ours, goal.relmse));
    double over = 0;
    for (const Point& point : ours.points) over = std::max(over, point.relmse / error_at(restart, point.seconds));
    worst.push_back(over);
    // Processor time, of a frame of one sample and of four.
    cost_one.push_back(100 * ours.reproject_seconds / (threads * restart.points[0].seconds));
    cost_four.push_back(100 * ours.reproject_seconds / (threads * restart.points[2].seconds));
    for (int k = 0; k < 2; ++k) {
      const Point& point = k == 0 ? ours.points[1] : last;  // a single sample has no second half everywhere
      calibration[k].push_back(std::sqrt(point.reported / point.relmse));
      inside[k].push_back(100 * point.inside);
    }
    bias.push_back(100 * (last.mean / goal.mean - 1));
    share.push_back(100 * ours.points.front().share);
  }
  // As published: its reported error knows nothing of reuse, so it is not held against the true one.
  void add_paper(const Curve& combined_curve, const Curve& reproject_curve, const Curve& restart) {
    const Point& goal = restart.points[combined_curve.points.size() - 1];
    paper_combined.push_back(goal.seconds / seconds_to(combined_curve, goal.relmse));
    paper_reproject.push_back(goal.seconds / seconds_to(reproject_curve, goal.relmse));
    double over = 0, bias_of_worse = 0;
    for (const Curve* curve : {&combined_curve, &reproject_curve}) {
      for (const Point& point : curve->points) over = std::max(over, point.relmse / error_at(restart, point.seconds));
      const double off = 100 * (curve->points.back().mean / goal.mean - 1);
      if (std::abs(off) > std::abs(bias_of_worse)) bias_of_worse = off;
    }
    paper_worst.push_back(over);
    paper_bias.push_back(bias_of_worse);
  }
  // Of ours over the better one of the two published ones, seed by seed.
  std::vector<double> over_paper() const {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < combined.size(); ++i)
      ratios.push_back(combined[i] / std::max(paper_combined[i], paper_reproject[i]));
    return ratios;
  }
  void publish(const std::string& name, bool with_cost, Figures& figures) const {
    figures.add({name + ".combined_over_restart", median(combined), "x", std::nullopt, Better::higher});
    figures.add({name + ".reproject_over_restart", median(reproject), "x", std::nullopt, Better::higher});
    figures.add({name + ".worst_error_over_restart", median(worst), "x", 1.10, Better::lower});
    figures.add({name + ".paper_combined_over_restart", median(paper_combined), "x", std::nullopt, Better::higher});
    figures.add({name + ".paper_reproject_over_restart", median(paper_reproject), "x", std::nullopt, Better::higher});
    figures.add({name + ".paper_worst_error_over_restart", median(paper_worst), "x", std::nullopt, Better::lower});
    figures.add({name + ".paper_mean_over_restart", median(paper_bias), "%", std::nullopt, Better::lower});
    // The goal is of turn_5 alone, which is the motion with costs.
    figures.add({name + ".combined_over_paper", median(over_paper()), "x",
                 with_cost ? std::optional(2.0) : std::nullopt, Better::higher});
    for (int k = 0; k < 2; ++k) {
      const std::string at = k == 0 ? ".at_two" : ".at_last";
      figures.add({name + at + ".reported_over_true", median(calibration[k]), "x", std::nullopt, Better::lower});
      figures.add({name + at + ".within_three", median(inside[k]), "%", 99.0, Better::higher});
    }
    figures.add({name + ".mean_over_restart", median(bias), "%", std::nullopt, Better::lower});
    figures.add({name + ".carried", median(share), "%", std::nullopt, Better::higher});
    if (!with_cost) return;
    figures.add({name + ".cost_of_one_sample", median(cost_one), "%", 25.0, Better::lower});
    figures.add({name + ".cost_of_four_samples", median(cost_four), "%", 8.0, Better::lower});
  }
};

// Adds the scene's median gain to `gains`, one list for each motion.
Status measure(RenderEngine& engine, const ErrorScene& scene, const std::vector<Motion>& all,
               const BenchOptions& options, Figures& figures, std::vector<std::vector<double>>& gains) {
  RenderSettings settings = scene.settings;
  const auto most = std::uint32_t(options.samples);
  std::vector<Results> results(all.size());
  for (int seed = 1; seed <= options.seeds; ++seed) {
    settings.seed = std::uint64_t(seed);
    const auto restart = run(engine, scene, settings, RenderMode::pt, {}, 2 * most);
    if (!restart) return restart.error();
    for (std::size_t m = 0; m < all.size(); ++m) {
      const auto combined = run(engine, scene, settings, RenderMode::combined, all[m], most);
      if (!combined) return combined.error();
      const auto reproject = run(engine, scene, settings, RenderMode::reproject, all[m], most);
      if (!reproject) return reproject.error();
      const auto paper_combined = run(engine, scene, settings, RenderMode::combined, all[m], most, ModeVariant::paper);
      if (!paper_combined) return paper_combined.error();
      const auto paper_reproject =
          run(engine, scene, settings, RenderMode::reproject, all[m], most, ModeVariant::paper);
      if (!paper_reproject) return paper_reproject.error();
      results[m].add(*combined, *restart, options.threads);
      results[m].add_paper(*paper_combined, *paper_reproject, *restart);
      const Point& goal = restart->points[restart->points.size() - 2];
      results[m].reproject.push_back(goal.seconds / seconds_to(*reproject, goal.relmse));
    }
  }
  for (std::size_t m = 0; m < all.size(); ++m) {
    const std::string name = scene.name + "." + all[m].name;
    results[m].publish(name, m == 0, figures);
    const double gain = median(results[m].combined);
    gains[m].push_back(gain);
    const double share = newly_seen_share(*scene.scene, all[m].before, scene.view, settings.width, settings.height);
    if (share == 1) continue;
    figures.add({name + ".newly_seen", 100 * share, "%", std::nullopt, Better::lower});
    figures.add({name + ".share_of_ceiling", 100 * gain * share, "%", all[m].goal_of_ceiling, Better::higher});
  }
  return ok_status();
}

}  // namespace

Status run_reuse(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  if (options.samples < 4)
    return Error{ErrorCode::invalid_argument, std::to_string(options.samples) + " is below 4", "--samples"};
  RenderEngine engine(options.threads);
  const std::vector<std::string> defaults = {"cornell",        "covered",         "glass",
                                             "cornell-glossy", "sponza-dabrovic", "breakfast-room"};
  std::vector<std::vector<double>> gains;
  std::vector<Motion> all;
  for (const std::string& name : options.scenes.empty() ? defaults : options.scenes) {
    const auto opened = open_error_scene(options, name, engine);
    if (!opened) return opened.error();
    const std::optional<ErrorScene>& scene = *opened;
    if (!scene) continue;
    const auto depth = scene_depth(*scene->scene, scene->view);
    if (!depth) return depth.error();
    all = motions(*scene, *depth);
    gains.resize(all.size());
    if (const Status done = measure(engine, *scene, all, options, figures, gains); !done) return done;
  }
  for (std::size_t m = 0; m < gains.size(); ++m) {
    const std::string name = "all." + all[m].name;
    figures.add({name + ".median", median(gains[m]), "x", all[m].goal, Better::higher});
    figures.add({name + ".worst", *std::min_element(gains[m].begin(), gains[m].end()), "x",
                 m == 0 ? std::optional(2.0) : std::nullopt, Better::higher});
  }
  return ok_status();
}

}  // namespace helio::bench
