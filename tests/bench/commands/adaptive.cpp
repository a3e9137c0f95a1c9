// Mode adaptive against uniform counts: gain at equal time, as a share of what any allocation can gain.
#include <array>
#include <cmath>

#include "renderer/comparison/power_law.h"
#include "renderer/frame/integrate_function.h"
#include "renderer/metrics/dark_half.h"
#include "renderer/metrics/error_metrics.h"
#include "tests/bench/commands/tile_tracing.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/scenes/error_scenes.h"
#include "tests/bench/scenes/over_scenes.h"
#include "tests/bench/scenes/study_scenes.h"
#include "tests/bench/subcommands.h"

namespace helio::bench {

namespace {

const double kRelativeEpsilon = RelativeEpsilon::image_mean().value;  // of relMSE, times mean(r)^2

// What counts can make small: the measures of RenderSettings::adaptive, and the errors of pictures that go with them.
enum Metric { kRelmse, kMse, kMetrics };
const struct {
  const char* name;
  ErrorMeasure measure;
} kMetricNames[kMetrics] = {{"relmse", ErrorMeasure::relmse}, {"mse", ErrorMeasure::rmse}};

// Of one metric: mean(s^2) mean(c) / mean(s sqrt(c))^2, the gain of n ~ s / sqrt(c) over uniform counts at equal cost.
struct CeilingSums {
  double s2 = 0, s_root_c = 0;
};

// s: deviation of a sample, over the denominator of relMSE if the metric is that, from this many samples a pixel; c:
// rays of a sample of the pixel's block. By Metric.
Result<std::array<double, kMetrics>> ceilings(const ErrorScene& scene, const RenderSettings& settings,
                                              const BenchOptions& options) {
  Film film(settings.width, settings.height);
  const RenderScene& render_scene = *scene.scene;
  const Camera camera(camera_pose(render_scene.description().cameras.at(0)), settings.width, settings.height,
                      render_scene.origin());
  trace_picture(render_scene, camera, path_settings(settings), options.samples, film.bounds(), options.threads, film);
  const double mean = mean_of(scene.reference), epsilon = kRelativeEpsilon * mean * mean;
  CeilingSums sums[kMetrics];
  double c1 = 0;
  std::size_t i = 0;
  for (int y = 0; y < settings.height; ++y) {
    for (int x = 0; x < settings.width; ++x, ++i) {
      double squared[kMetrics] = {}, rays = 0, paths = 0;
      for (int h = 0; h < kHalves; ++h) {
        const HalfPixel& half = film.half(h, x, y);
        const BlockWork work = film.work(h, x, y);
        rays += double(work.rays);
        paths += double(work.paths);
        for (int c = 0; c < 3 && half.count > 1; ++c) {
          const double r = scene.reference.channels[c][i];
          const double variance = 0.5 * half.deviations[c] / (half.count - 1.0) / 3;
          squared[kMse] += variance;
          squared[kRelmse] += variance / (r * r + epsilon);
        }
      }
      const double cost = rays / paths;
      c1 += cost;
      for (int m = 0; m < kMetrics; ++m) {
        sums[m].s2 += squared[m];
        sums[m].s_root_c += std::sqrt(squared[m] * cost);
      }
    }
  }
  if (!(sums[kMse].s_root_c > 0))
    return Error{ErrorCode::invalid_argument, "no sample of the picture varies", scene.name};
  std::array<double, kMetrics> most;
  for (int m = 0; m < kMetrics; ++m) most[std::size_t(m)] = sums[m].s2 * c1 / (sums[m].s_root_c * sums[m].s_root_c);
  return most;
}

struct Measured {
  double seconds = 0, rays = 0, mean = 0;
  double error[kMetrics] = {};  // less what the reference's noise adds
  double dark_bias = 0;         // of the dark half, against the reference
};

// What is rendered beside uniform counts, and the metric that its counts are to make small. As published the rule knows
// none: its pictures are held against both.
struct Kind {
  const char* name;
  ModeVariant variant;
  Metric metric;
  bool judged;  // has goals
};
constexpr Kind kKinds[] = {{"bounded", ModeVariant::bounded, kRelmse, true},
                           {"bounded", ModeVariant::bounded, kMse, true},
                           {"paper", ModeVariant::paper, kRelmse, false},
                           {"paper", ModeVariant::paper, kMse, false}};

Result<Measured> render(RenderEngine& engine, const ErrorScene& scene, RenderSettings settings, RenderMode mode,
                        const Kind& kind, int samples) {
  settings.mode = mode;
  settings.variant = kind.variant;
  if (kind.variant == ModeVariant::paper) settings.adaptive.min_samples = kPaperMinSamples;
  settings.adaptive.measure = kMetricNames[kind.metric].measure;
  const auto picture = render_picture(engine, scene.scene, settings, std::uint32_t(samples));
  if (!picture) return picture.error();
  const auto relative = relative_error(picture->view(), scene.reference.view());
  if (!relative) return relative.error();
  const auto squared = squared_error(picture->view(), scene.reference.view());
  if (!squared) return squared.error();
  Measured measured;
  measured.seconds = picture->seconds;
  measured.rays = double(picture->end.progress.trace.rays);
  measured.mean = mean_of(*picture);
  // As far as that leaves something.
  measured.error[kRelmse] = std::max(relative->relmse - reference_relmse(scene), 0.01 * relative->relmse);
  measured.error[kMse] = std::max(squared->mse - reference_mse(scene), 0.01 * squared->mse);
  measured.dark_bias = compare_dark_half(picture->view(), scene.reference.view()).bias;
  return measured;
}

// Error of uniform counts at `seconds`, between or beyond two measured points, as a power of time.
double uniform_error_at(const Measured& a, const Measured& b, Metric metric, double seconds) {
  return std::exp(log_on_power_law(a.seconds, a.error[metric], b.seconds, b.error[metric], seconds));
}

// Of one kind, an entry for each seed.
struct Series {
  std::vector<double> gain, ray_cost, bias, dark_bias;
};

// Of one scene, named without it.
std::vector<Figure> figures_of(const std::array<double, kMetrics>& most, const std::vector<Series>& all) {
  std::vector<Figure> figures;
  for (std::size_t k = 0; k < std::size(kKinds); ++k) {
    const Kind& kind = kKinds[k];
    const Series& series = all[k];
    const std::string metric = std::string("adaptive.") + kMetricNames[kind.metric].name;
    const double ceiling = most[kind.metric];
    if (kind.judged) {
      figures.push_back({metric + ".ceiling", ceiling, "x", std::nullopt, Better::higher});
      // Where the ceiling is high a gain of 2.5 is enough.
      const double least = ceiling > 3 ? 2.5 / ceiling : 0.85, share = median(series.gain) / ceiling;
      figures.push_back({metric + ".share_of_ceiling", share, "1", least, Better::higher});
      figures.push_back({metric + ".share_over_goal", share / least, "x", 1.0, Better::higher});
    }
    const std::string name = metric + "." + kind.name;
    figures.push_back({name + ".error_over_uniform", 1 / median(series.gain), "x",
                       kind.judged ? std::optional(1.05) : std::nullopt, Better::lower});
    figures.push_back({name + ".seconds_per_ray", median(series.ray_cost), "x", std::nullopt, Better::lower});
    figures.push_back({name + ".mean_over_uniform", median(series.bias), "%", std::nullopt, Better::within});
    const double dark = median(series.dark_bias);  // NaN where half of the picture is black
    if (std::isfinite(dark))
      figures.push_back({name + ".dark_half_over_uniform", dark, "%", std::nullopt, Better::within});
  }
  return figures;
}

Status measure(RenderEngine& engine, const ErrorScene& scene, const BenchOptions& options, Figures& figures,
               OverScenes& over_scenes) {
  RenderSettings settings = scene.settings;
  const auto most = ceilings(scene, settings, options);
  if (!most) return most.error();
  std::vector<Series> all(std::size(kKinds));
  for (int seed = 0; seed <= options.seeds; ++seed) {  // 0: the warm-up
    settings.seed = std::uint64_t(seed);
    const auto half = render(engine, scene, settings, RenderMode::pt, kKinds[0], options.samples / 2);
    if (!half) return half.error();
    const auto whole = render(engine, scene, settings, RenderMode::pt, kKinds[0], options.samples);
    if (!whole) return whole.error();
    for (std::size_t k = 0; k < std::size(kKinds); ++k) {
      const Kind& kind = kKinds[k];
      const auto adaptive = render(engine, scene, settings, RenderMode::adaptive, kind, options.samples);
      if (!adaptive) return adaptive.error();
      if (seed == 0) continue;
      Series& series = all[k];
      series.gain.push_back(uniform_error_at(*half, *whole, kind.metric, adaptive->seconds) /
                            adaptive->error[kind.metric]);
      series.ray_cost.push_back(adaptive->seconds / adaptive->rays * whole->rays / whole->seconds);
      series.bias.push_back(100 * (adaptive->mean / whole->mean - 1));
      series.dark_bias.push_back(100 * (adaptive->dark_bias - whole->dark_bias));
    }
  }
  for (Figure figure : figures_of(*most, all)) {
    // Each scene's share has the goal that its own ceiling says: over scenes it is share_over_goal that is judged.
    Figure over = figure;
    if (over.name.ends_with("share_of_ceiling")) over.goal.reset();
    over_scenes.add(over);
    figure.name = scene.name + "." + figure.name;
    figures.add(figure);
  }
  return ok_status();
}

}  // namespace

Status run_adaptive(BenchContext& context, Figures& figures) {
  const BenchOptions& options = context.options();
  RenderEngine engine(options.threads);
  OverScenes over_scenes;
  const Status done = measure_error_scenes(
      options, default_mode_scenes(), engine, kReferenceSamples,
      [&](const ErrorScene& scene) { return measure(engine, scene, options, figures, over_scenes); });
  if (done.ok()) over_scenes.publish(figures);
  return done;
}

}  // namespace helio::bench
