// What the kernel that SceneFeatures chooses earns over the general one, which renders the same bits.
#include "statistics.h"
#include "subcommands.h"
#include "tile_tracing.h"

namespace helio::bench {

namespace {

constexpr int kSamples = 8;

Status measure(const std::string& name, const std::filesystem::path& file, const BenchOptions& options,
               Figures& figures) {
  auto scene = load_bench_scene(file, options.threads);
  if (!scene) return scene.error();
  const Camera camera = first_camera(**scene, options.size);
  std::vector<double> specialised, general, gain;
  for (int i = -1; i < options.repeat; ++i) {
    double seconds[2];
    for (const bool is_general : {false, true}) {
      Film film(options.size, options.size);
      PathSettings settings;
      settings.roulette_from = 5;
      settings.general_kernel = is_general;
      seconds[is_general] =
          trace_picture(**scene, camera, settings, kSamples, film.bounds(), options.threads, film).seconds / kSamples;
    }
    if (i < 0) continue;  // warm-up
    specialised.push_back(seconds[0]);
    general.push_back(seconds[1]);
    gain.push_back(seconds[1] / seconds[0]);
  }
  figures.add({name + ".kernel_gain", median(gain), "x", std::nullopt, Better::higher});
  figures.add({name + ".chosen_kernel.seconds_per_sample", median(specialised), "s", std::nullopt, Better::lower});
  figures.add({name + ".general_kernel.seconds_per_sample", median(general), "s", std::nullopt, Better::lower});
  return ok_status();
}

}  // namespace

Status run_features(BenchContext& context, Figures& figures) {
  if (const Status done = measure("cornell", context.cornell(), context.options(), figures); !done) return done;
  const auto room = context.room();
  if (!room) {
    note(room.error().to_string());
    return ok_status();
  }
  return measure("room", *room, context.options(), figures);
}

}  // namespace helio::bench
