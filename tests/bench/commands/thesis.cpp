// Path tracing and bidirectional path tracing as in Soares' comparison (2020, "Path Tracing, Bidirectional Path Tracing
// and a Learned Denoiser", tables 4.1 and B.1 to B.3): the scenes that stand for its own, paths of up to 32 segments,
// frames per second, structural dissimilarity and time by samples, its figures beside ours. Its machine is a graphics
// card, its pictures 1920x1080, and its bidirectional pictures do not tend to those of its path tracer, so that what
// compares is how error falls. A frame is one sample of every pixel (its section 4.3), added to those before.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "tests/bench/commands/error_curves.h"
#include "tests/bench/scenes/loop_rendering.h"
#include "tests/bench/subcommands.h"
#include "tests/support/loop_views.h"

namespace helio::bench {

namespace {

constexpr int kDepth = 32;
const std::vector<int> kCounts = {1, 8, 16, 64, 256, 1024, 4096, 16384};
constexpr int kFrames = 16;            // whose rate is measured, after one that is thrown away
constexpr int kReferenceOverMost = 4;  // samples of references made here over those of the last point, at least

struct Row {
  int samples;
  double seconds, dssim;
};

constexpr Row kTeapotPt[] = {{1, 0.005, 0.39787133},     {8, 0.039, 0.26160547},     {16, 0.078, 0.23111120},
                             {64, 0.315, 0.15784105},    {256, 1.248, 0.07981995},   {1024, 5.019, 0.03635421},
                             {4096, 20.165, 0.01291957}, {16384, 96.396, 0.00424378}};
constexpr Row kTeapotBdpt[] = {{1, 0.021, 0.51703851},    {2, 0.039, 0.51923883},    {4, 0.078, 0.39809779},
                               {15, 0.315, 0.25522760},   {60, 1.248, 0.16639614},   {238, 5.019, 0.11592539},
                               {954, 20.165, 0.08846302}, {4610, 96.396, 0.07062779}};
constexpr Row kDragonPt[] = {{1, 0.009, 0.67127678},     {8, 0.076, 0.53247813},      {16, 0.151, 0.49367307},
                             {64, 0.604, 0.41864464},    {256, 2.420, 0.31710149},    {1024, 9.459, 0.20818218},
                             {4096, 38.492, 0.10746079}, {16384, 154.397, 0.04065980}};
constexpr Row kDragonBdpt[] = {{1, 0.024, 0.70049155},     {4, 0.076, 0.60348738},     {7, 0.151, 0.53577495},
                               {25, 0.604, 0.38973450},    {49, 2.420, 0.24681416},    {405, 9.459, 0.15275928},
                               {1562, 38.492, 0.08936442}, {6299, 154.397, 0.05268307}};
constexpr Row kBreakfastPt[] = {{1, 0.006, 2.33128486},     {8, 0.049, 3.49258348},      {16, 0.1, 3.04279178},
                                {64, 0.4, 1.88681548},      {256, 1.606, 1.15137247},    {1024, 6.393, 0.65067683},
                                {4096, 25.504, 0.32394587}, {16384, 102.059, 0.13719233}};
constexpr Row kBreakfastBdpt[] = {{1, 0.018, 2.28904392},     {3, 0.049, 2.80307390},     {6, 0.1, 3.19377557},
                                  {23, 0.4, 2.36387127},      {89, 1.606, 1.37773956},    {347, 6.393, 0.72884005},
                                  {1405, 25.504, 0.36259777}, {5633, 102.059, 0.15782825}};

// Frames per second, table 4.1.
struct Rates {
  double hd, full_hd;  // at 1280x720 and 1920x1080
};
struct ThesisScene {
  const char* name;
  std::span<const Row> pt, bdpt;
  Rates pt_rates, bdpt_rates;
};
const ThesisScene kScenes[] = {
    {"cornell-teapot", kTeapotPt, kTeapotBdpt, {416.2, 208.3}, {103.9, 48.3}},
    {"cornell-dragon-res2-covered-light", kDragonPt, kDragonBdpt, {219.7, 104.7}, {87.0, 40.8}},
    {"breakfast-room", kBreakfastPt, kBreakfastBdpt, {332.7, 158.7}, {118.3, 55.4}}};

CurveReport published(const std::string& scene, const std::string& mode, std::span<const Row> rows,
                      const Rates& rates) {
  CurveReport curve{scene, "soares 2020", mode, 0, {}};
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  curve.frame_rates = {{1280, 720, rates.hd, kUnknown}, {1920, 1080, rates.full_hd, kUnknown}};
  constexpr Interval kNone{kUnknown, kUnknown, kUnknown};
  for (const Row& row : rows) {
    CurvePointReport point;
    point.samples = row.samples;
    point.seeds = 1;
    point.seconds = {row.seconds, kUnknown, kUnknown};
    point.dssim = {row.dssim, kUnknown, kUnknown};
    point.mse = point.relmse = point.distance_variance = point.dark_relmse = point.dark_bias = kNone;
    point.bias = point.bias_standard_error = kUnknown;
    curve.points.push_back(point);
  }
  return curve;
}

constexpr Integrator kIntegrators[] = {Integrator::path, Integrator::bdpt, Integrator::pt_bdpt};

RenderSettings settings_of(const ErrorScene& scene, Integrator integrator) {
  RenderSettings settings;
  settings.width = scene.reference.width;
  settings.height = scene.reference.height;
  settings.max_segments = kDepth;
  settings.integrator = integrator;
  return settings;
}

std::vector<Contender> contenders(RenderEngine& engine, const ErrorScene& scene) {
  std::vector<Contender> all;
  for (const Integrator integrator : kIntegrators) {
    const std::string mode = integrator == Integrator::path ? "pt" : to_string(integrator);
    all.push_back({"heliograph", mode, [&engine, &scene, integrator](int samples, std::uint64_t seed) {
                     RenderSettings settings = settings_of(scene, integrator);
                     settings.seed = seed;
                     return render_picture(engine, scene.scene, settings, std::uint32_t(samples));
                   }});
  }
  return all;
}

// The camera rests, and each frame is resolved and shown. What pt+bdpt spends on choosing is in the first one.
FrameRate frame_rate(RenderEngine& engine, const ErrorScene& scene, Integrator integrator) {
  const RenderSettings settings = settings_of(scene, integrator);
  test::LoopViews views(engine, scene.scene, settings);
  double sum = 0, squares = 0;
  for (int i = 0; i <= kFrames; ++i) {
    const double seconds = views.render(scene.view, std::uint32_t(i + 1)).seconds;
    if (i == 0) continue;
    sum += 1 / seconds;
    squares += 1 / (seconds * seconds);
  }
  const double mean = sum / kFrames;
  return {settings.width, settings.height, mean,
          std::sqrt(std::max(squares / kFrames - mean * mean, 0.0) * kFrames / (kFrames - 1))};
}

}  // namespace

Result<std::vector<CurveReport>> run_thesis(BenchContext& context) {
  const BenchOptions& options = context.options();
  RenderEngine engine(options.threads);
  std::vector<CurveReport> curves;
  for (const ThesisScene& thesis : kScenes) {
    if (!options.scenes.empty() &&
        std::find(options.scenes.begin(), options.scenes.end(), thesis.name) == options.scenes.end())
      continue;
    const auto file = find_error_scene(options, thesis.name, SceneKind::any);
    if (!file) {
      note(file.error().to_string() + "; left out");
      continue;
    }
    RenderSettings how;
    how.max_segments = kDepth;
    how.integrator = Integrator::pt_bdpt;  // the covered light's is no path tracer's business
    const auto reference_samples = std::max(kReferenceSamples, std::uint32_t(kReferenceOverMost * options.samples));
    const auto scene = load_error_scene(options, *file, engine, reference_samples, how);
    if (!scene) return scene.error();
    std::vector<int> counts;
    for (const int count : kCounts) {
      if (count <= options.samples) counts.push_back(count);
    }
    auto measured = measure_curves(*scene, contenders(engine, *scene), counts, options.seeds);
    if (!measured) return measured.error();
    for (std::size_t k = 0; k < std::size(kIntegrators); ++k)
      (*measured)[k].frame_rates = {frame_rate(engine, *scene, kIntegrators[k])};
    curves.insert(curves.end(), measured->begin(), measured->end());
    curves.push_back(published(scene->name, "pt", thesis.pt, thesis.pt_rates));
    curves.push_back(published(scene->name, "bdpt", thesis.bdpt, thesis.bdpt_rates));
  }
  return curves;
}

}  // namespace helio::bench
