// Time per sample and time to a given error, ours and Mitsuba's in turns, then Cycles'.
#include "renderer/metrics/error_metrics.h"
#include "tests/bench/commands/time_to_error.h"
#include "tests/bench/peers/cycles_peer.h"
#include "tests/bench/peers/mitsuba_peer.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/scenes/error_scenes.h"
#include "tests/bench/scenes/loop_rendering.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

constexpr int kSamples = 16;           // per picture of the time per sample
constexpr int kMitsubaRoulette = 5;    // its default rr_depth
const ErrorGoal kGoal;

Status seconds_per_sample(const std::string& name, const std::shared_ptr<const RenderScene>& scene,
                          RenderEngine& engine, MitsubaPeer* peer, const BenchOptions& options, double goal,
                          Figures& figures) {
  RenderSettings settings;
  settings.width = settings.height = options.size;
  settings.roulette_from = kMitsubaRoulette;
  settings.roulette = RouletteRule::throughput;
  std::vector<double> ours, theirs;
  for (int i = -1; i < options.repeat; ++i) {
    settings.seed = std::uint64_t(i + 1);
    const auto picture = render_picture(engine, scene, settings, kSamples);
    if (!picture) return picture.error();
    if (i >= 0) ours.push_back(picture.value().seconds / kSamples);
    if (!peer) continue;
    const auto seconds = peer->render_seconds(name, kSamples, i + 1);
    if (!seconds) return seconds.error();
    if (i >= 0) theirs.push_back(*seconds / kSamples);
  }
  add_compared(name + ".seconds_per_sample", ours, theirs, goal, figures);
  return ok_status();
}

Status time_to_error(const BenchContext& context, const std::shared_ptr<const RenderScene>& scene, RenderEngine& engine,
                     MitsubaPeer* peer, Figures& figures) {
  const std::string reference_file = (context.bench_scenes() / "cornell.reference.exr").string();
  const auto reference = read_picture(reference_file);
  if (!reference) return reference.error();
  RenderSettings settings;  // our own roulette: what it costs and what it saves is part of the figure
  settings.width = reference.value().width;
  settings.height = reference.value().height;

  std::vector<double> ours, theirs;
  for (int i = -1; i < context.options().repeat; ++i) {
    settings.seed = std::uint64_t(i + 1);
    const auto curve = our_curve(scene, engine, settings, reference.value(), kGoal);
    if (!curve) return curve.error();
    const auto seconds = time_to(curve.value(), kGoal.target);
    if (!seconds) return Error{ErrorCode::internal, "our curve does not cross the target error", "cornell"};
    if (i >= 0) ours.push_back(*seconds);
    if (!peer) continue;
    const auto peer_curve = peer->error_curve("cornell", kMitsubaStep, i + 1, kGoal.target, 256, reference_file);
    if (!peer_curve) return peer_curve.error();
    const auto peer_seconds = time_to(peer_curve.value(), kGoal.target);
    if (!peer_seconds) return Error{ErrorCode::internal, "Mitsuba's curve does not cross the target error", "cornell"};
    if (i >= 0) theirs.push_back(*peer_seconds);
  }
  add_compared("cornell.time_to_error", ours, theirs, 0.8, figures);
  return ok_status();
}

// For information, without a goal. Each render of Cycles pays for synchronising the scene and for a BVH, which are no
// part of a sample: both figures are taken from differences to a picture of one sample.
Status cycles_figures(const BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  if (options.size != 512) return ok_status();
  auto peer = CyclesPeer::start(options.blender, options.threads);
  if (!peer) {
    note(peer.error().to_string());
    return ok_status();
  }
  if (const Status loaded = (*peer)->load(context.cornell().string()); !loaded) return loaded;
  note("beside Cycles " + (*peer)->version());
  const auto reference = read_picture((context.bench_scenes() / "cornell.reference.exr").string());
  if (!reference) return reference.error();
  const std::string picture_file = (context.folder() / "cycles.exr").string();

  std::vector<double> per_sample, to_error;
  for (int i = -1; i < options.repeat; ++i) {
    const auto start_up = (*peer)->render_seconds(1, i + 1);
    if (!start_up) return start_up.error();
    std::vector<CurvePoint> curve;
    for (const int samples : kErrorCounts) {
      const auto seconds = (*peer)->render_seconds(samples, i + 1, picture_file);
      if (!seconds) return seconds.error();
      const auto picture = read_picture(picture_file);
      if (!picture) return picture.error();
      const auto error =
          relative_error(picture.value().view(), reference.value().view(), RelativeEpsilon::fixed(kGoal.epsilon));
      if (!error) return error.error();
      curve.push_back({samples, *seconds - *start_up, error.value().relmse});
      if (error.value().relmse <= kGoal.target) break;
    }
    const auto seconds = time_to(curve, kGoal.target);
    if (!seconds) return Error{ErrorCode::internal, "Cycles' curve does not cross the target error", "cornell"};
    if (i < 0) continue;  // warm-up
    per_sample.push_back(curve.back().seconds / (curve.back().samples - 1));
    to_error.push_back(*seconds);
  }
  figures.add({"cornell.seconds_per_sample.cycles", median(per_sample), "s", std::nullopt, Better::lower});
  figures.add({"cornell.time_to_error.cycles", median(to_error), "s", std::nullopt, Better::lower});
  return ok_status();
}

}  // namespace

Status run_speed(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  std::unique_ptr<MitsubaPeer> peer;
  if (options.size != 512) {
    note("Mitsuba's pictures are 512x512: with another --size the figures over it are left out");
  } else if (auto started = MitsubaPeer::start(options.mitsuba_python, options.threads); !started) {
    note(started.error().to_string());
  } else {
    peer = std::move(started).value();
  }

  RenderEngine engine(options.threads);
  {
    auto scene = load_bench_scene(context.cornell(), options.threads);
    if (!scene) return scene.error();
    if (peer) {
      const Status loaded = peer->load("cornell", context.cornell_xml().string());
      if (!loaded) return loaded;
      note("compared with Mitsuba " + peer->version());
    }
    Status done = seconds_per_sample("cornell", *scene, engine, peer.get(), options, 1.2, figures);
    if (!done) return done;
    done = time_to_error(context, *scene, engine, peer.get(), figures);
    if (!done) return done;
    done = cycles_figures(context, figures);
    if (!done) return done;
  }

  const auto room = context.room();
  if (!room) {
    note(room.error().to_string());
    return ok_status();
  }
  auto scene = load_bench_scene(*room, options.threads);
  if (!scene) return scene.error();
  if (peer) {
    const auto xml = context.room_xml();
    if (!xml) return xml.error();
    const Status loaded = peer->load("room", xml->string());
    if (!loaded) return loaded;
  }
  return seconds_per_sample("room", *scene, engine, peer.get(), options, 1.0, figures);
}

}  // namespace helio::bench
