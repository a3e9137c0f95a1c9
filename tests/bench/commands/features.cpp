// What the kernel that SceneFeatures chooses earns over the general one, which renders the same bits; what mip-mapping
// earns over bilinear textures, and what it costs in bias.
#include "tests/bench/commands/tile_tracing.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/subcommands.h"

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

constexpr int kFilterSide = 256, kFilterSamples = 128;

// Sponza under a constant sky, by both filters with the same random numbers. The difference d of the pictures is known
// twice, from either half, with independent errors: the mean of dA dB is that of the squared bias alone, however noisy
// the pictures are.
Status measure_filter(const std::filesystem::path& file, const BenchOptions& options, Figures& figures) {
  std::vector<Film> films;
  for (const TextureFilter filter : {TextureFilter::bilinear, TextureFilter::mip}) {
    auto scene = load_bench_scene(file, options.threads, "1,1,1", filter);
    if (!scene) return scene.error();
    films.emplace_back(kFilterSide, kFilterSide);
    trace_picture(**scene, first_camera(**scene, kFilterSide), PathSettings{}, kFilterSamples, films.back().bounds(),
                  options.threads, films.back());
  }
  double means[2] = {0, 0}, squared_bias = 0, noise[2] = {0, 0};
  for (int y = 0; y < kFilterSide; ++y) {
    for (int x = 0; x < kFilterSide; ++x) {
      for (int c = 0; c < 3; ++c) {
        double value[2][2];  // filter, half
        for (int f = 0; f < 2; ++f) {
          for (int h = 0; h < kHalves; ++h) value[f][h] = films[f].half(h, x, y).sum[c] / films[f].half(h, x, y).count;
          means[f] += 0.5 * (value[f][0] + value[f][1]);
        }
        const double scale = 1 / (3.0 * kFilterSide * kFilterSide);
        const double reference = 0.5 * (value[0][0] + value[0][1]), divisor = reference * reference + 0.01;
        squared_bias += scale * (value[1][0] - value[0][0]) * (value[1][1] - value[0][1]) / divisor;
        for (int f = 0; f < 2; ++f)
          noise[f] += scale * 0.25 * (value[f][0] - value[f][1]) * (value[f][0] - value[f][1]) / divisor;
      }
    }
  }
  figures.add({"sponza.mip.mean_bias", 100 * (means[1] / means[0] - 1), "%", std::nullopt, Better::lower});
  figures.add({"sponza.mip.relmse_of_bias", squared_bias, "1", std::nullopt, Better::lower});
  figures.add({"sponza.mip.noise_over_bilinear", noise[1] / noise[0], "x", std::nullopt, Better::lower});
  return ok_status();
}

}  // namespace

Status run_features(BenchContext& context, Figures& figures) {
  if (const Status done = measure("cornell", context.cornell(), context.options(), figures); !done) return done;
  const auto sponza = std::filesystem::path(context.options().shared) / "scenes/glb/sponza-dabrovic.glb";
  if (const Status done = measure_filter(sponza, context.options(), figures); !done) return done;
  const auto room = context.room();
  if (!room) {
    note(room.error().to_string());
    return ok_status();
  }
  return measure("room", *room, context.options(), figures);
}

}  // namespace helio::bench
