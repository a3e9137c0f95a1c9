#include "tests/bench/commands/first_frame.h"

#include "tests/bench/reports/statistics.h"
#include "tests/bench/scenes/error_scenes.h"
#include "tests/bench/scenes/loop_rendering.h"
#include "tests/support/loop_views.h"

namespace helio::bench {

namespace {

constexpr int kSide = 512;
constexpr double kFirstFrameGoal = 1.5;
// Samples a second of every pixel, 512x512, as measured elsewhere on two cores of such a machine.
constexpr double kPbrtRate = 0.40, kSmallVcmRate = 2.27, kPbrtGoal = 5, kSmallVcmGoal = 1.5;
constexpr std::uint32_t kRateSamples = 8;

RenderSettings settings_of(Integrator integrator) {
  RenderSettings settings;
  settings.width = settings.height = kSide;
  settings.integrator = integrator;
  return settings;
}

}  // namespace

Status add_first_frames(BenchContext& context, RenderEngine& engine, Figures& figures) {
  const BenchOptions& options = context.options();
  for (const std::string name : {"cornell", "glass"}) {
    auto scene = load_bench_scene(context.bench_scenes() / (name + ".gltf"), options.threads);
    if (!scene) return scene.error();
    const std::shared_ptr<const RenderScene> built = *scene;
    const CameraPose here = camera_pose(built->description().cameras.at(0));
    for (const Integrator integrator : {Integrator::lvc, Integrator::vcm, Integrator::photon}) {
      // Two loops that differ in this alone, through the same moves in turns.
      RenderLoopOptions forgetful;
      forgetful.keep_light_vertices = false;
      test::LoopViews keeping(engine, built, settings_of(integrator));
      test::LoopViews rebuilding(engine, built, settings_of(integrator), forgetful);
      keeping.render(here, 1);
      rebuilding.render(here, 1);
      std::vector<double> kept, anew;
      for (int i = -1; i < options.repeat; ++i) {
        const CameraPose there = test::turned_and_shifted(here, i % 2 == 0 ? 5 : -5, 0);
        const double rebuilt = rebuilding.render(there, 1).seconds;
        const double reused = keeping.render(there, 1).seconds;
        if (i < 0) continue;
        anew.push_back(rebuilt);
        kept.push_back(reused);
      }
      const std::string figure = name + ".first_frame." + to_string(integrator);
      figures.add({figure, median(anew) / median(kept), "x", kFirstFrameGoal, Better::higher});
      figures.add({figure + ".seconds", median(kept), "s", std::nullopt, Better::lower});
    }
  }
  return ok_status();
}

Status add_bidirectional_rate(BenchContext& context, RenderEngine& engine, Figures& figures) {
  const BenchOptions& options = context.options();
  auto scene = load_bench_scene(context.bench_scenes() / "cornell.gltf", options.threads);
  if (!scene) return scene.error();
  std::vector<double> seconds;
  for (int i = -1; i < options.repeat; ++i) {
    Budget budget;
    budget.samples = kRateSamples;
    const double took = test::render_through_loop(engine, *scene, settings_of(Integrator::bdpt), budget).seconds;
    if (i >= 0) seconds.push_back(took);
  }
  const double rate = kRateSamples / median(seconds);
  figures.add({"cornell.bdpt.samples_per_second", rate, "1/s", std::nullopt, Better::higher});
  figures.add({"cornell.bdpt.over_pbrt", rate / kPbrtRate, "x", kPbrtGoal, Better::higher});
  figures.add({"cornell.bdpt.over_smallvcm", rate / kSmallVcmRate, "x", kSmallVcmGoal, Better::higher});
  return ok_status();
}

}  // namespace helio::bench
