// The layer display beside the film that it is made of: error, the error that it tells, and its time.
#include <cmath>
#include <future>
#include <string>
#include <vector>

#include "renderer/base/clock.h"
#include "renderer/metrics/error_metrics.h"
#include "tests/bench/scenes/error_scenes.h"
#include "tests/bench/scenes/over_scenes.h"
#include "tests/bench/subcommands.h"
#include "tests/support/tile_rows.h"

namespace helio::bench {

namespace {

// Samples a pixel, and what relMSE over the film's is to be there in the median. Of 1,024 samples the layer has less error
// than the references that we can afford.
struct Count {
  std::uint32_t samples;
  double median_goal;
};
constexpr Count kCounts[] = {{4, 0.25}, {64, 0.6}};
constexpr double kWorstGoal = 1.02;
// At this count the layer's share of the film's time is told.
constexpr std::uint32_t kCountOfShare = 64;
// Of references that are made here. Their noise is taken off.
constexpr std::uint32_t kReference = 1024;

const char* const kScenes[] = {"cornell",         "covered",   "glass",          "cornell-glossy-boxes",
                               "cornell-teapot",  "veach-mis", "sponza-dabrovic", "breakfast-room"};

struct DisplayPicture {
  LoopPicture film, display;
  std::vector<float> error;
  double layer_seconds = 0, all_seconds = 0;  // of processor time
};

class DisplaySink final : public FrameSink {
 public:
  explicit DisplaySink(DisplayPicture& picture) : picture_(picture) {}

  void frame_begun(const FrameBegin&) override {}
  void tile_ready(FrameTile tile) override {
    const ResolvedTile& pixels = tile.pixels;
    for (int c = 0; c < 3; ++c) {
      test::put_rows(pixels.radiance[c], pixels.window, picture_.film.width, picture_.film.channels[c]);
      test::put_rows(pixels.display[c], pixels.window, picture_.film.width, picture_.display.channels[c]);
    }
    test::put_rows(pixels.display_error, pixels.window, picture_.film.width, picture_.error);
  }
  void frame_ended(const FrameEnd& end) override { end_.set_value(end); }

  FrameEnd wait() { return end_.get_future().get(); }

 private:
  DisplayPicture& picture_;
  std::promise<FrameEnd> end_;
};

Result<DisplayPicture> render(RenderEngine& engine, const ErrorScene& scene, std::uint32_t samples) {
  RenderSettings settings = scene.settings;
  settings.mode = RenderMode::pt;
  DisplayPicture picture;
  for (LoopPicture* of : {&picture.film, &picture.display}) {
    of->width = settings.width;
    of->height = settings.height;
    for (auto& channel : of->channels) channel.assign(of->view().pixels(), 0.0f);
  }
  picture.error.assign(picture.film.view().pixels(), 0.0f);
  const auto sink = std::make_shared<DisplaySink>(picture);
  RenderLoopOptions options;
  options.channels |= kResolveDisplay;
  Budget budget;
  budget.samples = samples;
  RenderLoop loop(engine, scene.scene, settings, budget, RenderRank::job, sink, options);
  RenderLoop::Update update;
  update.view = View{1, scene.view};
  update.view->camera.aspect = 0;
  loop.update(update);
  const FrameEnd end = sink->wait();
  if (end.reason != FrameEndReason::samples)
    return Error{ErrorCode::internal, "the frame failed: " + end.message, scene.name};
  for (const PassTime& pass : end.passes) {
    picture.all_seconds += pass.seconds;
    if (pass.pass == "display") picture.layer_seconds = pass.seconds;
  }
  return picture;
}

// Less what the reference's noise adds. failed_precondition: that is more than half of it, and so the rest not known.
Result<double> without_noise(double error, double noise, const ErrorScene& scene) {
  if (error < 2 * noise) return Error{ErrorCode::failed_precondition, "the reference is too noisy", scene.name};
  return error - noise;
}

Result<double> relmse(const LoopPicture& picture, const ErrorScene& scene) {
  const auto error = relative_error(picture.view(), scene.reference.view());
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
  for (const Count& count : kCounts) {
    const auto picture = render(engine, scene, count.samples);
    if (!picture) return picture.error();
    std::string at = ".";
    at += std::to_string(count.samples);
    const auto film = relmse(picture->film, scene), display = relmse(picture->display, scene);
    if (film && display) {
      add({"relmse_over_film" + at, *display / *film, "x", kWorstGoal, Better::lower}, count.median_goal);
    } else {
      note(scene.name + at + ": " + (film ? display : film).error().to_string());
    }
    const auto squared = squared_error(picture->display.view(), scene.reference.view());
    if (!squared) return squared.error();
    double told = 0;
    for (const float error : picture->error) told += double(error) * error;
    if (const auto mse = without_noise(squared->mse, reference_mse(scene), scene)) {
      const double ratio = std::sqrt(told / double(picture->error.size()) / *mse);
      add({"error_told" + at, ratio, "x", 1.4, Better::within, 0.7});
    } else {
      note(scene.name + at + ": " + mse.error().to_string());
    }
    if (count.samples != kCountOfShare) continue;
    add({"nanoseconds_a_pixel", 1e9 * picture->layer_seconds / double(picture->error.size()), "ns", std::nullopt});
    add({"share_of_time" + at, picture->layer_seconds / picture->all_seconds, "", 0.1, Better::lower});
  }
  return ok_status();
}

}  // namespace

Status run_display(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  RenderEngine engine(options.threads);
  OverScenes all;
  const std::vector<std::string> names =
      options.scenes.empty() ? std::vector<std::string>(std::begin(kScenes), std::end(kScenes)) : options.scenes;
  for (const std::string& name : names) {
    const auto file = find_error_scene(options, name, SceneKind::any);
    if (!file) {
      if (!options.scenes.empty()) return file.error();
      note(file.error().to_string());
      continue;
    }
    const auto scene = load_error_scene(options, *file, engine, kReference);
    if (!scene) return scene.error();
    if (const Status measured = measure(engine, *scene, figures, all); !measured.ok()) return measured;
  }
  all.publish(figures);
  return ok_status();
}

}  // namespace helio::bench
