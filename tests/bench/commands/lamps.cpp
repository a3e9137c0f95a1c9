// Selecting one of many lights: error and time in a hall of lamps.
#include <string>
#include <vector>

#include "renderer/metrics/reference_halves.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/scenes/lamp_hall.h"
#include "tests/bench/scenes/loop_rendering.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

constexpr int kLamps[] = {1, 100, 10000};
constexpr std::uint32_t kSamples = 16;
// A pixel of either half of the reference, whose noise is taken off.
constexpr std::uint32_t kReferenceCount = 128;

Status measure(RenderEngine& engine, int lamps, const BenchOptions& options, Figures& figures) {
  RenderSceneOptions scene_options;
  scene_options.threads = options.threads;
  const auto scene = RenderScene::build(lamp_hall(lamps), scene_options);
  if (!scene) return scene.error();
  const std::string name = "lamps." + std::to_string(lamps);
  RenderSettings settings;
  settings.height = options.size == BenchOptions().size ? 360 : options.size;
  settings.width = settings.height * 16 / 9;
  const auto picture = [&](std::uint64_t seed, std::uint32_t samples) {
    settings.seed = seed;
    return render_picture(engine, *scene, settings, samples);
  };
  const auto a = picture(1u << 20, kReferenceCount), b = picture(1u << 21, kReferenceCount);
  if (!a || !b) return (a ? b : a).error();

  std::vector<double> errors, seconds, products;
  for (int i = -1; i < options.repeat; ++i) {
    const auto measured = picture(std::uint64_t(i + 1), kSamples);
    if (!measured) return measured.error();
    const auto error = unbiased_relative_error(measured->view(), a->view(), b->view(), RelativeEpsilon::fixed());
    if (!error) return error.error();
    if (i < 0) continue;  // warm-up
    errors.push_back(error->value);
    seconds.push_back(measured->seconds);
    products.push_back(error->value * measured->seconds);
  }
  figures.add({name + ".relmse", median(errors), "1", std::nullopt, Better::lower});
  figures.add({name + ".seconds_per_sample", median(seconds) / kSamples, "s", std::nullopt, Better::lower});
  figures.add({name + ".error_x_time", median(products), "s", std::nullopt, Better::lower});
  return ok_status();
}

}  // namespace

Status run_lamps(BenchContext& context, Figures& figures) {
  RenderEngine engine(context.options().threads);
  for (const int lamps : kLamps) {
    if (const Status done = measure(engine, lamps, context.options(), figures); !done) return done;
  }
  return ok_status();
}

}  // namespace helio::bench
