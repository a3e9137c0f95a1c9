// What reuse is worth after a camera move: time to the error that a restart has at a given number of samples.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <map>
#include <numeric>
#include <span>

#include "renderer/metrics/dark_half.h"
#include "renderer/metrics/error_metrics.h"
#include "tests/bench/reports/reuse_report.h"
#include "tests/bench/scenes/error_scenes.h"
#include "tests/bench/scenes/newly_seen.h"
#include "tests/bench/scenes/over_scenes.h"
#include "tests/bench/scenes/reuse_motions.h"
#include "tests/bench/scenes/scene_depth.h"
#include "tests/bench/scenes/study_scenes.h"
#include "tests/bench/subcommands.h"
#include "tests/support/loop_views.h"

namespace helio::bench {

namespace {

using test::LoopViews;
using test::ViewPicture;

// Where ours has not reached the restart's error it goes on to this many times the samples.
constexpr std::uint32_t kFurther = 4;
// Samples of the views before a frame whose cost is measured: what sources cost does not depend on how many they have.
constexpr std::uint32_t kCostRest = 64;

// A scene with what the noise of its reference adds to errors.
struct MeasuredScene {
  const ErrorScene& scene;
  double relmse = 0, dark_relmse = 0;  // of the reference's noise
  double mean = 0;                     // of the reference

  explicit MeasuredScene(const ErrorScene& of) : scene(of), relmse(reference_relmse(of)), mean(mean_of(of.reference)) {
    LoopPicture off = scene.reference;  // by the standard error of each value
    for (int c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < off.channels[c].size(); ++i)
        off.channels[c][i] += std::sqrt(std::max(0.0f, scene.reference_variance.channels[c][i]));
    }
    dark_relmse = compare_dark_half(off.view(), scene.reference.view()).relmse;
  }
};

// What kind of session renders the views.
struct Kind {
  RenderMode mode;
  ModeVariant variant = ModeVariant::bounded;
};

RenderSettings settings_of(const MeasuredScene& scene, const Kind& kind, std::uint64_t seed) {
  RenderSettings settings = scene.scene.settings;
  settings.mode = kind.mode;
  settings.variant = kind.variant;
  if (kind.variant == ModeVariant::paper) settings.adaptive.min_samples = kPaperMinSamples;
  settings.seed = seed;
  return settings;
}

// Those that history is made of; a restart has seen the last one, too, so that its memory is as warm.
void render_earlier(LoopViews& views, const Kind& kind, std::span<const EarlierView> before) {
  if (!reuses(kind.mode)) {
    views.render(before.back().pose, 1);
    return;
  }
  for (const EarlierView& view : before) views.render(view.pose, view.samples);
}

// Less what the reference's noise has added, as far as that leaves something.
double without_noise(double error, double noise) {
  return std::max(error - noise, 0.01 * error);
}

// Shares of the pixels' channels, and of the pixels, that lie within three of the standard errors that they and the
// reference report.
void count_inside(const ViewPicture& picture, const ErrorScene& scene, ReusePoint& point) {
  std::size_t channels = 0, pixels = 0;
  for (std::size_t i = 0; i < picture.samples.size(); ++i) {
    double off2 = 0, variance = 0;
    for (int c = 0; c < 3; ++c) {
      const double off = double(picture.radiance[c][i]) - double(scene.reference.channels[c][i]);
      const double known = double(picture.variance[c][i]) + double(scene.reference_variance.channels[c][i]);
      channels += off * off <= 9 * known;
      off2 += off * off;
      variance += known;
    }
    pixels += off2 <= 9 * variance;
  }
  point.inside = double(channels) / (3.0 * double(picture.samples.size()));
  point.pixels_inside = double(pixels) / double(picture.samples.size());
}

Result<ReusePoint> point_of(const ViewPicture& picture, const MeasuredScene& of) {
  const ErrorScene& scene = of.scene;
  if (picture.end.reason != FrameEndReason::samples)
    return Error{ErrorCode::internal, std::string("a frame ended by ") + to_string(picture.end.reason), scene.name};
  const auto error = relative_error(picture.view(), scene.reference.view());
  if (!error) return error.error();
  const DarkHalf dark = compare_dark_half(picture.view(), scene.reference.view());
  ReusePoint point;
  point.relmse = without_noise(error->relmse, of.relmse);
  point.noise = of.relmse;
  point.dark_relmse = without_noise(dark.relmse, of.dark_relmse);
  point.reported = picture.end.progress.error.relmse;
  count_inside(picture, scene, point);
  point.bias = test::mean_radiance(picture) / of.mean - 1;
  point.dark_bias = dark.bias;
  point.bound =
      std::accumulate(picture.bound.begin(), picture.bound.end(), 0.0) / (double(picture.bound.size()) * of.mean);
  point.carried = picture.end.progress.reuse_share;
  return point;
}

// The last view at 1, 2, 4, ... `most` samples, and on to `further` of them while errors are above `goal`'s.
Result<ReuseCurve> run(RenderEngine& engine, const MeasuredScene& scene, const Kind& kind, std::uint64_t seed,
                       const ReuseMotion& motion, std::uint32_t most, std::uint32_t further = 0,
                       const ReusePoint& goal = {}) {
  RenderLoopOptions with_bound;  // which ours alone have to pay for
  with_bound.channels |= kResolveHistory;
  LoopViews views(engine, scene.scene.scene, settings_of(scene, kind, seed), with_bound);
  render_earlier(views, kind, motion.before);
  ReuseCurve curve;
  double seconds = 0;
  for (std::uint32_t n = 1; n <= std::max(most, further); n *= 2) {
    if (n > most && curve.points.back().relmse <= goal.relmse && !(curve.points.back().dark_relmse > goal.dark_relmse))
      break;
    const ViewPicture& picture = views.render(scene.scene.view, n);
    auto point = point_of(picture, scene);
    if (!point) return point.error();
    seconds += picture.seconds;
    point->seconds = seconds;
    curve.points.push_back(*point);
  }
  return curve;
}

// The picture whose error the others' times are taken to: the restart's at the samples asked for, the last but one.
const ReusePoint& goal_of(const ReuseCurve& restart) {
  return restart.points[restart.points.size() - 2];
}

// Of a frame of `samples` after the last two of the earlier views, which sources are made of.
FrameCost cost_of(RenderEngine& engine, const MeasuredScene& scene, const Kind& kind, std::uint64_t seed,
                  const ReuseMotion& motion, std::uint32_t samples) {
  LoopViews views(engine, scene.scene.scene, settings_of(scene, kind, seed));
  std::vector<EarlierView> before(motion.before.end() - std::ptrdiff_t(std::min<std::size_t>(2, motion.before.size())),
                                  motion.before.end());
  for (EarlierView& view : before) view.samples = std::min(view.samples, kCostRest);
  render_earlier(views, kind, before);
  const std::clock_t began = std::clock();
  const ViewPicture& picture = views.render(scene.scene.view, samples);
  FrameCost cost;
  cost.all = double(std::clock() - began) / CLOCKS_PER_SEC;
  for (const PassTime& pass : picture.end.passes) {
    for (const char* reuse : {"reproject", "review", "allocate"}) {
      if (pass.pass == reuse) cost.reuse += pass.seconds;
    }
  }
  return cost;
}

// That of the last view's fresh samples in modes with reuse, in which every view has one of its own.
std::uint64_t last_seed(RenderEngine& engine, const MeasuredScene& scene, std::uint64_t seed,
                        const ReuseMotion& motion) {
  LoopViews views(engine, scene.scene.scene, settings_of(scene, {RenderMode::combined}, seed));
  for (const EarlierView& view : motion.before) views.render(view.pose, 1);
  return views.render(scene.scene.view, 1).seed;
}

Result<OtherModes> measure_others(RenderEngine& engine, const MeasuredScene& scene, const ReuseMotion& motion,
                                  std::uint32_t most, std::uint64_t seed, const ReusePoint& goal) {
  const Kind pt{RenderMode::pt}, ours{RenderMode::combined};
  const Kind paper_ours{RenderMode::combined, ModeVariant::paper};
  const Kind paper_reproject{RenderMode::reproject, ModeVariant::paper};
  OtherModes others;
  for (int k = 0; k < 2; ++k) {
    const auto samples = std::uint32_t(kCostCounts[k]);
    others.restart_cost[k] = cost_of(engine, scene, pt, seed, motion, samples);
    others.combined_cost[k] = cost_of(engine, scene, ours, seed, motion, samples);
    others.paper_combined_cost[k] = cost_of(engine, scene, paper_ours, seed, motion, samples);
    others.paper_reproject_cost[k] = cost_of(engine, scene, paper_reproject, seed, motion, samples);
  }
  const struct {
    Kind kind;
    ReuseCurve& curve;
    std::uint32_t further;
  } runs[] = {
      {{RenderMode::reproject}, others.reproject, kFurther * most},
      {paper_ours, others.paper_combined, 0},
      {paper_reproject, others.paper_reproject, 0}};
  for (const auto& [kind, curve, further] : runs) {
    auto measured = run(engine, scene, kind, seed, motion, most, further, goal);
    if (!measured) return measured.error();
    curve = std::move(*measured);
  }
  return others;
}

// One entry for each motion.
Result<std::vector<ReuseSeed>> measure_seed(RenderEngine& engine, const MeasuredScene& scene,
                                            const std::vector<ReuseMotion>& motions, std::uint32_t most,
                                            bool ours_alone, std::uint64_t seed) {
  const Kind pt{RenderMode::pt}, ours{RenderMode::combined};
  std::map<std::uint64_t, ReuseCurve> restarts;  // by seed: motions with as many views have the same
  std::vector<ReuseSeed> all(motions.size());
  for (std::size_t m = 0; m < motions.size(); ++m) {
    ReuseSeed& result = all[m];
    // With the fresh samples that ours has: what chance does to both is not what they are compared by.
    const std::uint64_t same = last_seed(engine, scene, seed, motions[m]);
    if (!restarts.contains(same)) {
      auto restart = run(engine, scene, pt, same, motions[m], 2 * most);
      if (!restart) return restart.error();
      restarts[same] = std::move(*restart);
    }
    result.restart = restarts[same];
    auto combined = run(engine, scene, ours, seed, motions[m], most, kFurther * most, goal_of(result.restart));
    if (!combined) return combined.error();
    result.combined = std::move(*combined);
    if (ours_alone) continue;
    auto others = measure_others(engine, scene, motions[m], most, seed, goal_of(result.restart));
    if (!others) return others.error();
    result.others = std::move(*others);
  }
  return all;
}

Status measure(RenderEngine& engine, const ErrorScene& scene, const std::vector<ReuseMotion>& motions,
               const BenchOptions& options, Figures& figures, OverScenes& over_scenes) {
  const MeasuredScene measured(scene);
  const auto most = std::uint32_t(options.samples);
  std::vector<std::vector<ReuseSeed>> seeds(motions.size());
  for (int seed = 1; seed <= options.seeds; ++seed) {
    auto of_seed = measure_seed(engine, measured, motions, most, options.ours_alone, std::uint64_t(seed));
    if (!of_seed) return of_seed.error();
    for (std::size_t m = 0; m < motions.size(); ++m) seeds[m].push_back(std::move((*of_seed)[m]));
  }
  const std::size_t points = seeds.front().front().restart.points.size() - 1;
  for (std::size_t m = 0; m < motions.size(); ++m) {
    std::vector<CameraPose> poses;
    for (const EarlierView& view : motions[m].before) poses.push_back(view.pose);
    const double newly_seen =
        newly_seen_share(*scene.scene, poses, scene.view, scene.reference.width, scene.reference.height);
    const ReuseReport report = report_reuse(seeds[m], points, newly_seen, motions[m].goals);
    for (const ReuseFigure& reported : report.figures) {
      Figure figure = reported.figure;
      figure.name = motions[m].name + "." + reported.figure.name;
      over_scenes.add(figure, reported.median_goal);
      figure.name = scene.name + "." + figure.name;
      figures.add(figure);
    }
    for (const std::string& text : report.notes) note(scene.name + "." + motions[m].name + ": " + text);
  }
  return ok_status();
}

}  // namespace

Status run_reuse(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  if (options.samples < 4)
    return Error{ErrorCode::invalid_argument, std::to_string(options.samples) + " is below 4", "--samples"};
  const bool all_motions = options.motions == std::vector<std::string>{"all"};
  const std::vector<std::string>& names = options.motions.empty() ? default_reuse_motions()
                                          : all_motions           ? reuse_motion_names()
                                                                  : options.motions;
  RenderEngine engine(options.threads);
  OverScenes over_scenes;
  const auto measure_motions = [&](const ErrorScene& scene) -> Status {
    const auto depth = scene_depth(*scene.scene, scene.view);
    if (!depth) return depth.error();
    std::vector<ReuseMotion> motions;
    for (const std::string& motion : names) {
      auto made = reuse_motion(motion, scene.view, *depth);
      if (!made) return made.error();
      motions.push_back(std::move(*made));
    }
    return measure(engine, scene, motions, options, figures, over_scenes);
  };
  const Status done = measure_error_scenes(options, default_mode_scenes(), engine, kReferenceSamples, measure_motions);
  if (done.ok()) over_scenes.publish(figures);
  return done;
}

}  // namespace helio::bench
