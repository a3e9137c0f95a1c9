// Real scenes as Mitsuba XML of diffuse materials, beside Mitsuba on the same file.
#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "renderer/metrics/error_metrics.h"
#include "tests/bench/commands/real.h"
#include "tests/bench/peers/mitsuba_twin.h"
#include "tests/bench/reports/statistics.h"
#include "tests/bench/scenes/reference_pictures.h"
#include "tests/bench/scenes/scene_settings.h"

namespace helio::bench {

namespace {

constexpr int kReferenceSamples = 128;  // per pixel, of each renderer's half of the reference
constexpr int kReferenceSeed = 1000;    // no run has it
constexpr int kCountedSamples = 4;      // per pixel, for rays a path
constexpr double kMostSegmentDifference = 0.02;
constexpr double kMostMeanDifference = 0.005;

// The scene in both renderers.
struct Twin {
  const RealScene& scene;
  std::shared_ptr<const RenderScene> loaded;
  RenderSettings settings;  // of integrator path
  RenderEngine& engine;
  MitsubaPeer& peer;
  std::string picture_file;  // by which Mitsuba's pictures come

  Result<LoopPicture> ours(Integrator integrator, int samples, int seed) const {
    RenderSettings chosen = settings;
    chosen.integrator = integrator;
    chosen.seed = std::uint64_t(seed);
    return render_picture(engine, loaded, chosen, std::uint32_t(samples));
  }
  Result<LoopPicture> theirs(int samples, int seed) const {
    return peer.render_picture(scene.name, samples, seed, picture_file);
  }
};

Result<Twin> make_twin(const BenchContext& context, const RealScene& scene, RenderEngine& engine, MitsubaPeer& peer) {
  const BenchOptions& options = context.options();
  const auto xml = write_mitsuba_twin(options.mitsuba_python, {scene.file, scene.width, scene.height, scene.sky},
                                      context.folder() / scene.name);
  if (!xml) return xml.error();
  if (const Status loaded = peer.load(scene.name, xml->string()); !loaded) return loaded.error();
  const auto loaded = load_bench_scene(*xml, options.threads);
  if (!loaded) return loaded.error();
  const SceneDescription& description = (*loaded)->description();
  RenderSettings settings = scene_settings(description, description.cameras.at(0));
  settings.width = scene.width;
  settings.height = scene.height;
  settings.roulette = RouletteRule::throughput;  // Mitsuba's
  return Twin{scene, *loaded, settings, engine, peer, (context.folder() / "mitsuba.exr").string()};
}

// The mean of a long picture by each, which favours neither, and the relMSE that its own noise adds to errors against
// it: the pictures are independent, so a half of their difference has the noise of their mean.
struct TwinReference {
  LoopPicture picture;
  double noise = 0;
  double mean_ratio = 1;  // ours over theirs
};

Result<TwinReference> make_reference(const Twin& twin) {
  const auto ours = twin.ours(Integrator::path, kReferenceSamples, kReferenceSeed);
  if (!ours) return ours.error();
  const auto theirs = twin.theirs(kReferenceSamples, kReferenceSeed);
  if (!theirs) return theirs.error();
  TwinReference reference{*ours, 0, mean_of(*ours) / mean_of(*theirs)};
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < reference.picture.channels[c].size(); ++i)
      reference.picture.channels[c][i] = (ours->channels[c][i] + theirs->channels[c][i]) / 2;
  }
  const auto noise = relative_error(ours->view(), reference.picture.view(), RelativeEpsilon::fixed());
  if (!noise) return noise.error();
  reference.noise = noise->relmse;
  return reference;
}

// Of one way to render, in turns with others.
struct Series {
  std::vector<double> seconds_per_sample, error_x_time;

  Status add(const LoopPicture& picture, const TwinReference& reference) {
    const auto error = relative_error(picture.view(), reference.picture.view(), RelativeEpsilon::fixed());
    if (!error) return error.error();
    seconds_per_sample.push_back(picture.seconds / kRealSamples);
    error_x_time.push_back((error->relmse - reference.noise) * picture.seconds);
    return ok_status();
  }
};

struct Work {
  double ray_ratio = 1;    // rays a path, ours over Mitsuba's
  std::string difference;  // why no ratio can be given; empty: paths are as long, and pictures have the same mean
};

// Shadow rays are counted but not compared: how many there are is a matter of how lights are sampled, not of the paths.
Result<Work> compare_work(const Twin& twin, double mean_ratio, Figures& figures) {
  const auto picture = twin.ours(Integrator::path, kCountedSamples, kReferenceSeed);
  if (!picture) return picture.error();
  const TraceStats& trace = picture->end.progress.trace;
  const double paths = double(trace.paths), segments = double(trace.rays - trace.shadow_rays) / paths;
  const auto theirs = twin.peer.count_rays(twin.scene.name, kCountedSamples, kReferenceSeed, twin.settings.max_segments,
                                           twin.settings.roulette_from);
  if (!theirs) return theirs.error();
  const double ray_ratio = double(trace.rays) / paths / theirs->rays();
  const auto add = [&](const std::string& figure, double value, const char* unit) {
    figures.add({twin.scene.name + ".twin." + figure, value, unit, std::nullopt});
  };
  add("segments_per_path", segments, "rays");
  add("segments_per_path.mitsuba", theirs->segments, "rays");
  add("shadow_rays_per_path", double(trace.shadow_rays) / paths, "rays");
  add("shadow_rays_per_path.mitsuba", theirs->shadow_rays, "rays");
  add("shadow_rays_per_path.mitsuba_useful", theirs->useful_shadow_rays, "rays");
  add("rays_per_path.over_mitsuba", ray_ratio, "x");
  add("mean_over_mitsuba", mean_ratio, "x");
  if (!(std::abs(segments / theirs->segments - 1) <= kMostSegmentDifference))
    return Work{ray_ratio, fmt::format("a path has {:.2f} segments, Mitsuba's {:.2f}", segments, theirs->segments)};
  if (!(std::abs(mean_ratio - 1) <= kMostMeanDifference))
    return Work{ray_ratio, fmt::format("the mean of the picture is {:.4f} of Mitsuba's", mean_ratio)};
  return Work{ray_ratio, ""};
}

}  // namespace

Status measure_twin(const BenchContext& context, const RealScene& scene, RenderEngine& engine, MitsubaPeer& peer,
                    Figures& figures) {
  const auto twin = make_twin(context, scene, engine, peer);
  if (!twin) return twin.error();
  note(scene.name + ": beside Mitsuba " + peer.version());
  const auto reference = make_reference(*twin);
  if (!reference) return reference.error();
  const auto work = compare_work(*twin, reference->mean_ratio, figures);
  if (!work) return work.error();

  Series path, pt_bdpt, mitsuba;
  for (int i = -1; i < context.options().repeat; ++i) {
    const std::pair<Series*, Result<LoopPicture>> turns[] = {
        {&path, twin->ours(Integrator::path, kRealSamples, i + 1)},
        {&mitsuba, twin->theirs(kRealSamples, i + 1)},
        {&pt_bdpt, twin->ours(Integrator::pt_bdpt, kRealSamples, i + 1)}};
    for (const auto& [series, picture] : turns) {
      if (!picture) return picture.error();
      if (i < 0) continue;  // warm-up
      if (const Status added = series->add(*picture, *reference); !added) return added;
    }
  }
  if (!work->difference.empty()) {
    note(scene.name + ": no ratios over Mitsuba: " + work->difference);
    mitsuba = {};
  }
  const std::string name = scene.name + ".twin.";
  const auto beside = [&](const std::string& figure, std::vector<double> Series::*values, const Series& ours,
                          std::optional<double> goal) {
    add_beside({name + figure, "mitsuba", "s", ours.*values, mitsuba.*values, goal}, figures);
  };
  beside("seconds_per_sample", &Series::seconds_per_sample, path, 0.9);
  if (work->difference.empty()) {
    const double ratio = median(path.seconds_per_sample) / median(mitsuba.seconds_per_sample);
    figures.add({name + "seconds_per_ray.over_mitsuba", ratio / work->ray_ratio, "x", std::nullopt});
  }
  beside("error_x_time.path", &Series::error_x_time, path, std::nullopt);
  beside("error_x_time.pt+bdpt", &Series::error_x_time, pt_bdpt, 0.5);
  figures.add({name + "seconds_per_sample.pt+bdpt", median(pt_bdpt.seconds_per_sample), "s", std::nullopt});
  return ok_status();
}

}  // namespace helio::bench
