// Time to a given error with light paths and without, beside Mitsuba's path tracer where it is installed.
#include <algorithm>
#include <limits>

#include "renderer/metrics/error_metrics.h"
#include "renderer/trace/selection/unsampled_light.h"
#include "tests/bench/commands/first_frame.h"
#include "tests/bench/commands/time_to_error.h"
#include "tests/bench/peers/mitsuba_peer.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/scenes/error_scenes.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

struct Case {
  std::string scene;
  std::string figure = "time_to_error";
  // None: the error that the path tracer has at --samples, with an epsilon of 1e-2 of the reference's mean squared.
  std::optional<ErrorGoal> goal = std::nullopt;
  double ratio = 0;    // goal: over Mitsuba's seconds of the same run; 0: none
  double seconds = 0;  // goal, where there is no ratio; 0: none
};
constexpr double kMostSeconds = 40;  // of one picture: beyond it the time to the error is not measured
constexpr double kMostOverBest = 1.1;
// The last: what light there is in the covered box is so dim that an epsilon of 0.01 hides most of it.
const Case kCases[] = {{"cornell", "time_to_error", ErrorGoal{}, 0.65, 0},
                       {"glass", "time_to_error", ErrorGoal{}, 0.3, 0},
                       {"covered", "time_to_error", ErrorGoal{}, 0.06, 0},
                       {"covered", "dark_time_to_error", ErrorGoal{0.1, 1e-4}, 0, 2.5}};
const std::vector<int> kCounts = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024};
constexpr std::uint64_t kTargetSeed = 1u << 20;  // of no picture that is timed

// The single modes that tend to the scene's picture, then the mixed one. Those that merge are biased.
std::vector<Integrator> integrators_for(const RenderScene& scene) {
  std::vector<Integrator> all = {Integrator::path, Integrator::bdpt, Integrator::lvc};
  if (unsampled_light(Integrator::light, scene.features()).empty()) all.push_back(Integrator::light);
  all.push_back(Integrator::pt_bdpt);
  return all;
}

RenderSettings settings_of(const ErrorScene& scene, Integrator integrator, std::uint64_t seed) {
  RenderSettings settings;
  settings.width = scene.reference.width;
  settings.height = scene.reference.height;
  settings.integrator = integrator;
  settings.seed = seed;
  return settings;
}

Result<ErrorGoal> goal_of(const ErrorScene& scene, RenderEngine& engine, int samples) {
  const double mean = mean_of(scene.reference);
  ErrorGoal goal{0, RelativeEpsilon::image_mean().value * mean * mean};
  const auto picture =
      render_picture(engine, scene.scene, settings_of(scene, Integrator::path, kTargetSeed), std::uint32_t(samples));
  if (!picture) return picture.error();
  const auto error = relative_error(picture->view(), scene.reference.view(), RelativeEpsilon::fixed(goal.epsilon));
  if (!error) return error.error();
  goal.target = error->relmse;
  return goal;
}

// Adds pt+bdpt's time over that of the best single mode to `over_best`.
Status run_case(BenchContext& context, const Case& what, const ErrorScene& scene, RenderEngine& engine,
                MitsubaPeer* peer, std::vector<double>& over_best, Figures& figures) {
  const BenchOptions& options = context.options();
  const std::string name = scene.name + "." + what.figure;
  const bool compared = peer && what.ratio > 0;
  if (compared) {
    const std::string xml = (context.bench_scenes() / "mitsuba" / (what.scene + ".xml")).string();
    if (const Status loaded = peer->load(what.scene, xml); !loaded) return loaded;
  }
  const auto goal = what.goal ? Result<ErrorGoal>(*what.goal) : goal_of(scene, engine, options.samples);
  if (!goal) return goal.error();
  if (!what.goal) figures.add({name + ".relmse", goal->target, "", std::nullopt, Better::lower});

  const std::vector<Integrator> integrators = integrators_for(*scene.scene);
  std::vector<std::vector<double>> ours(integrators.size());
  std::vector<double> theirs;
  for (int i = -1; i < options.repeat; ++i) {
    for (std::size_t k = 0; k < integrators.size(); ++k) {
      // The first run warms up; what it does not finish in a while is not worth waiting for.
      const auto curve = our_curve(scene.scene, engine, settings_of(scene, integrators[k], std::uint64_t(i + 1)),
                                   scene.reference, *goal, kCounts, i < 0 ? 1.0 : kMostSeconds);
      if (!curve) return curve.error();
      if (i < 0) continue;
      ours[k].push_back(time_to(curve.value(), goal->target)
                            .value_or(curve.value().front().error <= goal->target
                                          ? curve.value().front().seconds
                                          : std::numeric_limits<double>::infinity()));
    }
    if (!compared || i < 0) continue;
    const std::string reference_file = (context.bench_scenes() / (what.scene + ".reference.exr")).string();
    const auto curve = peer->error_curve(what.scene, kMitsubaStep, i + 1, goal->target, 1024, reference_file);
    if (!curve) return curve.error();
    const auto seconds = time_to(curve.value(), goal->target);
    if (!seconds) return Error{ErrorCode::internal, "Mitsuba's curve does not cross the target error", name};
    theirs.push_back(*seconds);
  }
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < integrators.size(); ++k) {
    const double seconds = median(ours[k]);
    if (integrators[k] != Integrator::pt_bdpt) best = std::min(best, seconds);
    if (std::isfinite(seconds)) {
      figures.add({name + "." + to_string(integrators[k]), seconds, "s", std::nullopt, Better::lower});
    } else {
      note(name + "." + to_string(integrators[k]) + ": not in " + std::to_string(int(kMostSeconds)) + " s");
    }
  }
  const double mixed = median(ours.back());
  if (std::isfinite(best)) {
    over_best.push_back(mixed / best);
    if (std::isfinite(mixed)) figures.add({name + ".over_best", mixed / best, "x", kMostOverBest, Better::lower});
  }
  if (!std::isfinite(mixed)) return ok_status();
  if (what.ratio == 0) {
    figures.add({name, mixed, "s", what.seconds > 0 ? std::optional(what.seconds) : std::nullopt, Better::lower});
    return ok_status();
  }
  add_compared(name, {mixed}, theirs, what.ratio, figures);
  return ok_status();
}

// Those with goals of their own, of the scenes asked for; of others one with the path tracer's error.
std::vector<Case> cases_of(const std::vector<std::string>& scenes) {
  if (scenes.empty()) return {std::begin(kCases), std::end(kCases)};
  std::vector<Case> cases;
  for (const std::string& scene : scenes) {
    const std::size_t before = cases.size();
    std::copy_if(std::begin(kCases), std::end(kCases), std::back_inserter(cases),
                 [&](const Case& what) { return what.scene == scene; });
    if (cases.size() == before) cases.push_back({scene});
  }
  return cases;
}

}  // namespace

Status run_bidir(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  std::unique_ptr<MitsubaPeer> peer;
  if (auto started = MitsubaPeer::start(options.mitsuba_python, options.threads); !started) {
    note(started.error().to_string());
  } else {
    peer = std::move(started).value();
  }
  RenderEngine engine(options.threads);
  std::vector<double> over_best;
  std::optional<ErrorScene> scene;
  for (const Case& what : cases_of(options.scenes)) {
    const auto file = find_error_scene(options, what.scene, SceneKind::any);
    if (!file) return file.error();
    if (!scene || scene->file != *file) {
      auto loaded = load_error_scene(options, *file, engine, kReferenceSamples);
      if (!loaded) return loaded.error();
      scene = std::move(*loaded);
    }
    if (const Status done = run_case(context, what, *scene, engine, peer.get(), over_best, figures); !done) return done;
  }
  // Infinite where pt+bdpt missed what a single mode reached.
  if (!over_best.empty()) {
    figures.add({"over_best.median", median(over_best), "x", std::nullopt, Better::lower});
    figures.add({"over_best.worst", percentile(over_best, 1), "x", kMostOverBest, Better::lower});
  }
  if (!options.scenes.empty()) return ok_status();
  if (const Status done = add_first_frames(context, engine, figures); !done) return done;
  return add_bidirectional_rate(context, engine, figures);
}

}  // namespace helio::bench
