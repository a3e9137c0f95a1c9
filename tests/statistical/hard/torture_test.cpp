// No NaN and no Inf: the torture set, scenes thrown together at random from what is allowed but extreme. A short run of
// it here; HELIO_TORTURE_SAMPLES=1e9 for the long one, whose outcome tests/README.md tells, HELIO_TORTURE_FIRST for the
// number of its first scene, so that it may be cut into several. Half of the scenes are rendered with light paths, of
// which no splat may be NaN or Inf either. One scene in two thousand is brighter than splats may be (pixels of 1e16 and
// more): what the film leaves out there is counted.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <string>

#include "renderer/film/core/light_tiles.h"
#include "renderer/trace/paths/sample_trace.h"
#include "tests/statistical/hard/torture_scenes.h"
#include "tests/support/light_cache.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kWidth = 2 * kLightTile, kHeight = 16;
constexpr std::uint32_t kSamplesPerHalf = 32;
constexpr double kSamplesPerScene = double(kWidth) * kHeight * kSamplesPerHalf * kHalves;

double samples_wanted() {
  const char* text = std::getenv("HELIO_TORTURE_SAMPLES");
  return text ? std::max(kSamplesPerScene, std::strtod(text, nullptr)) : 20 * kSamplesPerScene;
}

std::uint64_t first_scene() {
  const char* text = std::getenv("HELIO_TORTURE_FIRST");
  return text ? std::strtoull(text, nullptr, 10) : 1;
}

std::string where(const RenderScene& scene, const CameraPose& pose, const PathSettings& settings,
                  const InvalidSample& sample) {
  SampleTrace trace;
  trace.width = kWidth;
  trace.height = kHeight;
  trace.sample = sample;
  trace_sample(scene, Camera(pose, kWidth, kHeight, scene.origin()), settings, CancelToken(), trace);
  const auto first = first_not_finite(trace);
  return first ? "vertex " + std::to_string(first->vertex) + ": " + first->quantity : "finite when traced again";
}

// Half of the scenes as the path tracer has them, the others with light paths.
Integrator integrator_of(std::uint64_t seed) {
  static constexpr Integrator kLightPaths[] = {Integrator::bdpt, Integrator::light, Integrator::pt_bdpt,
                                               Integrator::lvc,  Integrator::vcm,   Integrator::photon};
  return seed % 2 == 0 ? Integrator::path : kLightPaths[seed / 2 % std::size(kLightPaths)];
}

// With pt+bdpt the left one of two tiles has light paths.
Film film_for(Integrator integrator) {
  FilmState state;
  state.splats = traces_light_paths(integrator);
  Film film(kWidth, kHeight, state);
  if (integrator == Integrator::pt_bdpt) {
    auto tiles = std::make_shared<LightTiles>(kWidth, kHeight, false);
    tiles->set(0, true);
    film.set_light_tiles(std::move(tiles));
  }
  return film;
}

void trace_all(const std::shared_ptr<const RenderScene>& scene, const CameraPose& pose, const PathSettings& settings,
               Film& film, TraceStats& stats) {
  const Camera camera(pose, kWidth, kHeight, scene->origin());
  const CancelToken never;
  const auto trace = [&](const SampleRange& range, const LightVertexCache* lights) {
    for (int x = 0; x < kWidth; x += kLightTile) {
      const PixelRect tile{x, 0, x + kLightTile, kHeight};
      EXPECT_TRUE(trace_window(*scene, camera, settings, range, tile, never, film, stats, nullptr, lights));
    }
  };
  for (int half = 0; half < kHalves; ++half) {
    if (!caches_light_vertices(settings.integrator)) {
      trace({half, 0, kSamplesPerHalf}, nullptr);
      continue;
    }
    for (std::uint32_t sample = 0; sample < kSamplesPerHalf; ++sample) {
      const auto lights = make_light_cache(scene, settings, half, sample, kWidth * kHeight, &camera, film, stats);
      trace({half, sample, 1}, lights.get());
    }
  }
}

bool is_lit(const Film& film) {
  if (mean_of(film).mean.x > 0) return true;
  for (int pixel = 0; film.splats() && pixel < kWidth * kHeight; ++pixel) {
    for (int half = 0; half < kHalves; ++half) {
      if (film.splats()->mean(half, pixel % kWidth, pixel / kWidth).x > 0) return true;
    }
  }
  return false;
}

TEST(Torture, NoSampleIsInvalid) {
  const double wanted = samples_wanted();
  const std::uint64_t first = first_scene();
  double samples = 0;
  std::uint64_t invalid = 0, not_finite = 0, bright_splats = 0, bright_scenes = 0, lit = 0, light_paths = 0;
  for (std::uint64_t seed = first; samples < wanted; ++seed) {
    Extremes x(seed);
    const float scale = x.log_uniform(1e-4f, 1e6f);
    RenderSceneOptions options;
    options.threads = 1;
    options.texture_filter = x.chance(0.3f) ? TextureFilter::mip : TextureFilter::bilinear;
    const auto scene = build(torture_scene(x, scale), options);
    ASSERT_TRUE(scene) << seed;
    const CameraPose pose = torture_camera(x, scale);
    PathSettings settings;
    settings.seed = seed;
    settings.max_segments = x.chance(0.1f) ? 200 : 10;
    settings.roulette_from = x.chance(0.1f) ? 200 : 3;
    settings.integrator = integrator_of(seed);
    TraceStats stats;
    Film film = film_for(settings.integrator);
    trace_all(scene, pose, settings, film, stats);
    samples += kSamplesPerScene;
    invalid += stats.invalid_samples;
    not_finite += stats.invalid_splats - stats.bright_splats;
    bright_splats += stats.bright_splats;
    bright_scenes += stats.bright_splats > 0;
    light_paths += stats.light_paths;
    lit += is_lit(film);
    EXPECT_EQ(stats.invalid_samples, 0u) << "scene " << seed << ", " << to_string(settings.integrator) << ", pixel "
                                         << stats.first_invalid.x << "," << stats.first_invalid.y << ", half "
                                         << stats.first_invalid.half << ", sample " << stats.first_invalid.index << "; "
                                         << where(*scene, pose, settings, stats.first_invalid);
    EXPECT_EQ(stats.invalid_splats, stats.bright_splats) << "scene " << seed << ", " << to_string(settings.integrator);
    if (HasFailure() && seed >= first + 200) break;
  }
  std::printf(
      "%.3g samples and %.3g light paths in %llu scenes of which %llu are lit: %llu samples and %llu splats are not "
      "finite; %llu splats in %llu scenes are brighter than a film holds\n",
      samples, double(light_paths), static_cast<unsigned long long>(std::llround(samples / kSamplesPerScene)),
      static_cast<unsigned long long>(lit), static_cast<unsigned long long>(invalid),
      static_cast<unsigned long long>(not_finite), static_cast<unsigned long long>(bright_splats),
      static_cast<unsigned long long>(bright_scenes));
  EXPECT_LE(double(bright_scenes), 2 + 0.01 * samples / kSamplesPerScene) << "too much of the set is left out";
  EXPECT_GT(double(lit), 0.5 * samples / kSamplesPerScene) << "scenes without light test nothing";
}

}  // namespace
}  // namespace helio::test
