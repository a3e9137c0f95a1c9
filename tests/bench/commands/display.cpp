// The layer display beside the film that it is made of: error, the error that it tells, and its time.
#include <cmath>
#include <string>
#include <vector>

#include "renderer/metrics/error_metrics.h"
#include "tests/bench/commands/display_scenes.h"
#include "tests/bench/scenes/error_scenes.h"
#include "tests/bench/scenes/over_scenes.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

// Samples a pixel, and what relMSE over the film's is to be there in the median. Of 1,024 samples the layer has less
// error than the references that we can afford.
struct Count {
  std::uint32_t samples;
  double median_goal;
};
constexpr Count kCounts[] = {{4, 0.25}, {64, 0.6}};
constexpr double kWorstGoal = 1.02;
// At this count the layer's share of the film's time is told, of a picture that is shown while it is made.
constexpr std::uint32_t kCountOfShare = 64;
// 60 ms at 640x360 on two cores.
constexpr double kNanosecondsGoal = 521;

// Less what the reference's noise adds. failed_precondition: that is more than half of it, and so the rest not known.
Result<double> without_noise(double error, double noise, const ErrorScene& scene) {
  if (error < 2 * noise) return Error{ErrorCode::failed_precondition, "the reference is too noisy", scene.name};
  return error - noise;
}

Result<double> relmse(const PictureView& picture, const ErrorScene& scene) {
  const auto error = relative_error(picture, scene.reference.view());
  if (!error) return error.error();
  return without_noise(error->relmse, reference_relmse(scene), scene);
}

Status measure(RenderEngine& engine, const ErrorScene& scene, Figures& figures, OverScenes& all) {
  const auto add = [&](const Figure& figure, std::optional<double> median_goal = std::nullopt) {
    all.add(figure, median_goal);
    Figure own = figure;
    own.name.insert(0, scene.name + ".");
    figures.add(std::move(own));
  };
  RenderSettings settings = scene.settings;
  settings.mode = RenderMode::pt;
  RenderLoopOptions loop_options;
  loop_options.channels |= kResolveDisplay;
  for (const Count& count : kCounts) {
    const bool passes = count.samples == kCountOfShare;  // otherwise it is filtered once
    loop_options.publish_passes = passes;
    const auto picture = render_picture(engine, scene.scene, settings, count.samples, scene.view, loop_options);
    if (!picture) return picture.error();
    std::string at = ".";
    at += std::to_string(count.samples);
    const auto film = relmse(picture->view(), scene), display = relmse(picture->display_view(), scene);
    if (film && display) {
      add({"relmse_over_film" + at, *display / *film, "x", kWorstGoal, Better::lower}, count.median_goal);
    } else {
      note(scene.name + at + ": " + (film ? display : film).error().to_string());
    }
    const auto squared = squared_error(picture->display_view(), scene.reference.view());
    if (!squared) return squared.error();
    double told = 0;
    for (const float error : picture->display_error) told += double(error) * error;
    if (const auto mse = without_noise(squared->mse, reference_mse(scene), scene)) {
      const double ratio = std::sqrt(told / double(picture->display_error.size()) / *mse);
      add({"error_told" + at, ratio, "x", 1.4, Better::within, 0.7});
    } else {
      note(scene.name + at + ": " + mse.error().to_string());
    }
    double layer_seconds = 0, all_seconds = 0;  // of processor time
    for (const PassTime& pass : picture->end.passes) {
      all_seconds += pass.seconds;
      if (pass.pass == "display") layer_seconds = pass.seconds;
    }
    const double nanoseconds = 1e9 * layer_seconds / double(picture->display_error.size());
    if (!passes) add({"nanoseconds_a_pixel" + at, nanoseconds, "ns", kNanosecondsGoal, Better::lower});
    if (passes) add({"share_of_time" + at, layer_seconds / all_seconds, "", 0.1, Better::lower});
  }
  return ok_status();
}

}  // namespace

Status run_display(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  RenderEngine engine(options.threads);
  OverScenes all;
  const Status done =
      measure_error_scenes(options, display_scenes(), engine, kDisplayReference,
                           [&](const ErrorScene& scene) { return measure(engine, scene, figures, all); });
  if (done.ok()) all.publish(figures);
  return done;
}

}  // namespace helio::bench
