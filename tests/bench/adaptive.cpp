// Mode adaptive against uniform counts: gain at equal time, as a share of what any allocation can gain.
#include <cmath>

#include "dark_half.h"
#include "error_scenes.h"
#include "renderer/frame/integrate_function.h"
#include "renderer/metrics/error_metrics.h"
#include "statistics.h"
#include "subcommands.h"
#include "tile_tracing.h"

namespace helio::bench {

namespace {

const double kRelativeEpsilon = RelativeEpsilon::image_mean().value;  // of relMSE, times mean(r)^2

// mean(s^2) mean(c) / mean(s sqrt(c))^2: the gain of n ~ s / sqrt(c) over uniform counts at equal cost. s: deviation of
// a sample over the denominator of relMSE, from this many samples a pixel; c: rays of a sample of the pixel's block.
Result<double> ceiling(const ErrorScene& scene, const RenderSettings& settings, const BenchOptions& options) {
  Film film(settings.width, settings.height);
  const RenderScene& render_scene = *scene.scene;
  const Camera camera(camera_pose(render_scene.description().cameras.at(0)), settings.width, settings.height,
                      render_scene.origin());
  trace_picture(render_scene, camera, path_settings(settings), options.samples, film.bounds(), options.threads, film);
  double mean = 0;
  for (const auto& channel : scene.reference.channels) {
    for (const float value : channel) mean += value;
  }
  mean /= 3.0 * double(scene.reference.view().pixels());
  double s2 = 0, c1 = 0, s_root_c = 0;
  std::size_t i = 0;
  for (int y = 0; y < settings.height; ++y) {
    for (int x = 0; x < settings.width; ++x, ++i) {
      double squared = 0, rays = 0, paths = 0;
      for (int h = 0; h < kHalves; ++h) {
        const HalfPixel& half = film.half(h, x, y);
        const BlockWork work = film.work(h, x, y);
        rays += double(work.rays);
        paths += double(work.paths);
        for (int c = 0; c < 3 && half.count > 1; ++c) {
          const double r = scene.reference.channels[c][i];
          squared += 0.5 * half.deviations[c] / (half.count - 1.0) / (r * r + kRelativeEpsilon * mean * mean) / 3;
        }
      }
      const double cost = rays / paths;
      s2 += squared;
      c1 += cost;
      s_root_c += std::sqrt(squared * cost);
    }
  }
  if (!(s_root_c > 0)) return Error{ErrorCode::invalid_argument, "no sample of the picture varies", scene.name};
  return s2 * c1 / (s_root_c * s_root_c);
}

struct Measured {
  double seconds = 0, relmse = 0, rays = 0, mean = 0;
  double dark_bias = 0;  // of the dark half, against the reference
};

Result<Measured> render(RenderEngine& engine, const ErrorScene& scene, RenderSettings settings, RenderMode mode,
                        ModeVariant variant, int samples) {
  settings.mode = mode;
  settings.variant = variant;
  if (variant == ModeVariant::paper) settings.adaptive.min_samples = kPaperMinSamples;
  const auto picture = render_picture(engine, scene.scene, settings, std::uint32_t(samples));
  if (!picture) return picture.error();
  const auto error = relative_error(picture->view(), scene.reference.view());
  if (!error) return error.error();
  double mean = 0;
  for (const auto& channel : picture->channels) {
    for (const float value : channel) mean += value;
  }
  return Measured{picture->seconds, error->relmse, double(picture->end.progress.trace.rays), mean,
                  compare_dark_half(picture->view(), scene.reference.view()).bias};
}

// relMSE of uniform counts at `seconds`, between or beyond two measured points, as a power of time.
double uniform_error_at(const Measured& a, const Measured& b, double seconds) {
  const double slope = std::log(b.relmse / a.relmse) / std::log(b.seconds / a.seconds);
  return b.relmse * std::pow(seconds / b.seconds, slope);
}

Status measure(RenderEngine& engine, const ErrorScene& scene, const BenchOptions& options, Figures& figures) {
  RenderSettings settings = scene.settings;
  const auto most = ceiling(scene, settings, options);
  if (!most) return most.error();
  const struct {
    const char* name;
    RenderMode mode;
    ModeVariant variant;
  } kinds[] = {{"bounded", RenderMode::adaptive, ModeVariant::bounded},
               {"paper", RenderMode::adaptive, ModeVariant::paper}};
  std::vector<double> gain[2], ray_cost[2], bias[2], dark_bias[2];
  for (int seed = 0; seed <= options.seeds; ++seed) {  // 0: the warm-up
    settings.seed = std::uint64_t(seed);
    const auto half = render(engine, scene, settings, RenderMode::pt, ModeVariant::bounded, options.samples / 2);
    if (!half) return half.error();
    const auto whole = render(engine, scene, settings, RenderMode::pt, ModeVariant::bounded, options.samples);
    if (!whole) return whole.error();
    for (int k = 0; k < 2; ++k) {
      const auto adaptive = render(engine, scene, settings, kinds[k].mode, kinds[k].variant, options.samples);
      if (!adaptive) return adaptive.error();
      if (seed == 0) continue;
      gain[k].push_back(uniform_error_at(*half, *whole, adaptive->seconds) / adaptive->relmse);
      ray_cost[k].push_back(adaptive->seconds / adaptive->rays * whole->rays / whole->seconds);
      bias[k].push_back(100 * (adaptive->mean / whole->mean - 1));
      dark_bias[k].push_back(100 * (adaptive->dark_bias - whole->dark_bias));
    }
  }
  const std::string name = scene.name + ".adaptive";
  figures.add({name + ".ceiling", *most, "x", std::nullopt, Better::higher});
  const double goal = *most > 3 ? 2.5 / *most : 0.85;
  figures.add({name + ".share_of_ceiling", median(gain[0]) / *most, "1", goal, Better::higher});
  for (int k = 0; k < 2; ++k) {
    const std::string kind = name + "." + kinds[k].name;
    figures.add({kind + ".error_over_uniform", 1 / median(gain[k]), "x", k == 0 ? std::optional(1.05) : std::nullopt,
                 Better::lower});
    figures.add({kind + ".seconds_per_ray", median(ray_cost[k]), "x", std::nullopt, Better::lower});
    figures.add({kind + ".mean_over_uniform", median(bias[k]), "%", std::nullopt, Better::lower});
    const double dark = median(dark_bias[k]);  // NaN where half of the picture is black
    if (std::isfinite(dark)) figures.add({kind + ".dark_half_over_uniform", dark, "%", std::nullopt, Better::lower});
  }
  return ok_status();
}

}  // namespace

Status run_adaptive(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  RenderEngine engine(options.threads);
  const std::vector<std::string> defaults = {"cornell",        "covered",      "glass",
                                             "cornell-glossy", "veach-plates", "box-directional"};
  for (const std::string& name : options.scenes.empty() ? defaults : options.scenes) {
    const auto file = find_error_scene(options, name, SceneKind::any);
    if (!file) return file.error();
    const auto scene = load_error_scene(options, *file, engine, 64 * std::uint32_t(options.samples));
    if (!scene) return scene.error();
    if (const Status done = measure(engine, *scene, options, figures); !done) return done;
  }
  return ok_status();
}

}  // namespace helio::bench
