// Time to a given error with light paths and without, beside Mitsuba's path tracer where it is installed.
#include <algorithm>
#include <limits>

#include "error_scenes.h"
#include "first_frame.h"
#include "mitsuba_peer.h"
#include "statistics.h"
#include "subcommands.h"
#include "time_to_error.h"

namespace helio::bench {

namespace {

struct Case {
  const char* scene;
  const char* figure;
  ErrorGoal goal;
  double ratio;    // goal: over Mitsuba's seconds of the same run; 0: none
  double seconds;  // goal, where there is no ratio
};
constexpr double kMostSeconds = 40;  // of one picture: beyond it the time to the error is not measured
// The last: what light there is in the covered box is so dim that an epsilon of 0.01 hides most of it.
const Case kCases[] = {{"cornell", "time_to_error", {}, 0.65, 0},
                       {"glass", "time_to_error", {}, 0.3, 0},
                       {"covered", "time_to_error", {}, 0.06, 0},
                       {"covered", "dark_time_to_error", {0.1, 1e-4}, 0, 2.5}};
const std::vector<int> kCounts = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024};
constexpr Integrator kIntegrators[] = {Integrator::path, Integrator::bdpt, Integrator::path_bdpt};

Status run_case(BenchContext& context, const Case& what, RenderEngine& engine, MitsubaPeer* peer, Figures& figures) {
  const BenchOptions& options = context.options();
  const std::string name = std::string(what.scene) + "." + what.figure;
  const std::string reference_file = (context.bench_scenes() / (std::string(what.scene) + ".reference.exr")).string();
  const auto reference = read_picture(reference_file);
  if (!reference) return reference.error();
  auto scene = load_bench_scene(context.bench_scenes() / (std::string(what.scene) + ".gltf"), options.threads);
  if (!scene) return scene.error();
  if (peer) {
    const std::string xml = (context.bench_scenes() / "mitsuba" / (std::string(what.scene) + ".xml")).string();
    if (const Status loaded = peer->load(what.scene, xml); !loaded) return loaded;
  }

  std::vector<double> ours[std::size(kIntegrators)], theirs;
  for (int i = -1; i < options.repeat; ++i) {
    for (std::size_t k = 0; k < std::size(kIntegrators); ++k) {
      RenderSettings settings;
      settings.width = reference.value().width;
      settings.height = reference.value().height;
      settings.integrator = kIntegrators[k];
      settings.seed = std::uint64_t(i + 1);
      // The first run warms up; what it does not finish in a while is not worth waiting for.
      const auto curve =
          our_curve(*scene, engine, settings, reference.value(), what.goal, kCounts, i < 0 ? 1.0 : kMostSeconds);
      if (!curve) return curve.error();
      if (i < 0) continue;
      ours[k].push_back(time_to(curve.value(), what.goal.target)
                            .value_or(curve.value().front().error <= what.goal.target
                                          ? curve.value().front().seconds
                                          : std::numeric_limits<double>::infinity()));
    }
    if (!peer || what.ratio == 0 || i < 0) continue;
    const auto curve = peer->error_curve(what.scene, kMitsubaStep, i + 1, what.goal.target, 1024, reference_file);
    if (!curve) return curve.error();
    const auto seconds = time_to(curve.value(), what.goal.target);
    if (!seconds) return Error{ErrorCode::internal, "Mitsuba's curve does not cross the target error", name};
    theirs.push_back(*seconds);
  }
  double best = std::numeric_limits<double>::infinity(), mixed = best;
  for (std::size_t k = 0; k < std::size(kIntegrators); ++k) {
    const double seconds = median(ours[k]);
    if (kIntegrators[k] == Integrator::path_bdpt) {
      mixed = seconds;
    } else {
      best = std::min(best, seconds);
    }
    if (std::isfinite(seconds)) {
      figures.add({name + "." + to_string(kIntegrators[k]), seconds, "s", std::nullopt, Better::lower});
    } else {
      note(name + "." + to_string(kIntegrators[k]) + ": not in " + std::to_string(int(kMostSeconds)) + " s");
    }
  }
  if (!std::isfinite(mixed)) return ok_status();
  figures.add({name + ".over_best", mixed / best, "x", 1.1, Better::lower});
  if (what.ratio == 0) {
    figures.add({name, mixed, "s", what.seconds, Better::lower});
    return ok_status();
  }
  add_compared(name, {mixed}, theirs, what.ratio, figures);
  return ok_status();
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
  for (const Case& what : kCases) {
    if (const Status done = run_case(context, what, engine, peer.get(), figures); !done) return done;
  }
  if (const Status done = add_first_frames(context, engine, figures); !done) return done;
  return add_bidirectional_rate(context, engine, figures);
}

}  // namespace helio::bench
