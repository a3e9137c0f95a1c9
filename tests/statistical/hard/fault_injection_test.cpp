// Hard case 9: one sample in 1e5 is NaN or infinite. The picture stays finite and unbiased, every such sample is
// counted and can be traced again, and no pixel converges by it.
#include <gtest/gtest.h>

#include "renderer/trace/paths/sample_trace.h"
#include "tests/support/light_cache.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kSide = 64;
constexpr std::uint32_t kSamplesPerHalf = 256;

const CameraPose kPose = camera_at({0.3, 0.1, 0.6}, {-0.4, -0.2, -1}, 80);

// A room that emits and reflects a half of everything: 1 wherever one looks, along every path. On two walls lie patches
// whose reflectance is NaN and infinite; they emit like the rest, so the samples that do not reflect there are fair
// ones of the same picture. A path has 5 vertices or so on 24 units of wall: patches of 2.5e-5 units meet one in 1e5.
std::shared_ptr<const RenderScene> faulty_room() {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  SceneDescription scene;
  const Rgb half(0.5f, 0.5f, 0.5f);
  scene.materials = {lambert(half, half), lambert(Rgb(nan, nan, nan), half), lambert(Rgb(inf, inf, inf), half)};
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0, true));
  const float side = 0.005f;
  add_mesh(scene, quad({-0.999f, 0.2f, 0.1f}, {0, side, 0}, {0, 0, side}, 1));
  add_mesh(scene, quad({0.3f, -0.999f, -0.4f}, {0, 0, side}, {side, 0, 0}, 2));
  return build(std::move(scene));
}

PathSettings settings() {
  PathSettings path;
  path.max_segments = 24;  // 1 - 2^-24
  return path;
}

struct Faulty {
  std::shared_ptr<const RenderScene> room = faulty_room();
  TraceStats stats;
  Film film = render(*room, kPose, kSide, kSide, kSamplesPerHalf, settings(), &stats);
};

// Rendered once for both tests.
const Faulty& faulty() {
  static const Faulty once;
  return once;
}

TEST(FaultInjection, ThePictureIsFiniteAndUnbiasedAndEveryFaultIsCounted) {
  const TraceStats& stats = faulty().stats;
  const Film& film = faulty().film;
  const double samples = double(kSide) * kSide * kSamplesPerHalf * kHalves;
  EXPECT_GT(double(stats.invalid_samples), 2e-6 * samples);
  EXPECT_LT(double(stats.invalid_samples), 5e-5 * samples);
  std::uint64_t invalid = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      for (int h = 0; h < kHalves; ++h) {
        const HalfPixel& pixel = film.half(h, x, y);
        invalid += film.invalid(h, x, y);
        ASSERT_EQ(pixel.count + film.invalid(h, x, y), kSamplesPerHalf);
        for (int c = 0; c < 3; ++c) ASSERT_TRUE(std::isfinite(pixel.sum[c]) && std::isfinite(pixel.deviations[c]));
      }
      const PixelFeatures& f = film.features(x, y);
      for (int c = 0; c < 3; ++c) ASSERT_TRUE(std::isfinite(f.albedo[c]) && std::isfinite(f.normal[c]));
    }
  }
  EXPECT_EQ(invalid, stats.invalid_samples);
  const MeanEstimate e = mean_of(film);
  EXPECT_NEAR(e.mean.x, 1, 3 * e.standard_error.x + 2e-5);
  EXPECT_LT(e.standard_error.x, 1e-3);
}

// The sample that the counts name, and no neighbour of it, is invalid when traced alone.
TEST(FaultInjection, TheFirstFaultIsReplayed) {
  const auto& room = faulty().room;
  const TraceStats& stats = faulty().stats;
  ASSERT_GT(stats.invalid_samples, 0u);
  const Camera camera(kPose, kSide, kSide, room->origin());
  SampleTrace trace;
  trace.width = trace.height = kSide;
  trace.sample = stats.first_invalid;
  ASSERT_TRUE(trace_sample(*room, camera, settings(), CancelToken(), trace));
  EXPECT_FALSE(is_finite(trace.radiance));
  const auto first = first_not_finite(trace);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->quantity, "the material's base color");
  const VertexTrace& vertex = trace.vertices[std::size_t(first->vertex) - 1];
  EXPECT_FALSE(is_finite(vertex.params.base_color));
  EXPECT_NE(vertex.material, 0u);
  trace.sample.index += 1;
  ASSERT_TRUE(trace_sample(*room, camera, settings(), CancelToken(), trace));
  EXPECT_TRUE(is_finite(trace.radiance));
}

// With light paths, which meet faults as well, and over a region, whose samples alone light paths start with.
TEST(FaultInjection, ASampleWithALightPathIsReplayed) {
  const auto& room = faulty().room;
  constexpr std::uint32_t kSamples = 96;
  PathSettings path;
  path.max_segments = 6;
  path.integrator = Integrator::bdpt;
  path.region = {4, 3, 60, 62};
  FilmState state;
  state.splats = true;
  Film film(kSide, kSide, state);
  const Camera camera(kPose, kSide, kSide, room->origin());
  TraceStats stats;
  for (int half = 0; half < kHalves; ++half) {
    ASSERT_TRUE(trace_window(*room, camera, path, {half, 0, kSamples}, path.region, CancelToken(), film, stats));
  }
  ASSERT_GT(stats.invalid_samples, 0u);
  EXPECT_EQ(stats.first_invalid.light_paths, std::uint64_t(path.region.area()));
  SampleTrace trace;
  trace.width = trace.height = kSide;
  trace.sample = stats.first_invalid;
  ASSERT_TRUE(trace_sample(*room, camera, path, CancelToken(), trace));
  EXPECT_FALSE(is_finite(trace.radiance));
  EXPECT_TRUE(first_not_finite(trace).has_value());
  trace.sample.index += 1;
  ASSERT_TRUE(trace_sample(*room, camera, path, CancelToken(), trace));
  EXPECT_TRUE(is_finite(trace.radiance));
}

constexpr int kFloorSide = 16;

const CameraPose kOverFloor = camera_at({0, 1, 2}, {0, 0, 0}, 40);

// A floor under a point light.
std::shared_ptr<const RenderScene> lit_floor(float intensity) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f))};
  add_mesh(scene, quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0));
  PunctualLight light;
  light.position = {0, 0.5, 0};
  light.intensity = Rgb(intensity);
  scene.lights = {light};
  return build(std::move(scene));
}

// One light path for each pixel of the floor's picture.
TraceStats trace_splats(const std::shared_ptr<const RenderScene>& scene, const PathSettings& path) {
  const Camera camera(kOverFloor, kFloorSide, kFloorSide, scene->origin());
  FilmState state;
  state.splats = true;
  Film film(kFloorSide, kFloorSide, state);
  TraceStats stats;
  if (caches_light_vertices(path.integrator)) {
    make_light_cache(scene, path, 1, 4, kFloorSide * kFloorSide, &camera, film, stats);
  } else {
    EXPECT_TRUE(trace_window(*scene, camera, path, {1, 4, 1}, film.bounds(), CancelToken(), film, stats));
  }
  return stats;
}

SampleTrace first_traced_again(const std::shared_ptr<const RenderScene>& scene, const PathSettings& path,
                               const TraceStats& stats) {
  SampleTrace trace;
  trace.width = trace.height = kFloorSide;
  trace.sample = stats.first_invalid;
  const Camera camera(kOverFloor, kFloorSide, kFloorSide, scene->origin());
  EXPECT_TRUE(trace_sample(*scene, camera, path, CancelToken(), trace));
  return trace;
}

// A light path that brings the camera more than any float says is told as well, whether it goes with one sample or is
// shared by all.
TEST(FaultInjection, ALightPathThatIsInvalidAtTheCameraIsReplayed) {
  const auto scene = lit_floor(3e37f);
  for (const Integrator integrator : {Integrator::light, Integrator::lvc}) {
    SCOPED_TRACE(to_string(integrator));
    PathSettings path;
    path.integrator = integrator;
    const TraceStats stats = trace_splats(scene, path);
    ASSERT_GT(stats.invalid_splats, stats.bright_splats);
    EXPECT_EQ(stats.invalid_samples, 0u);
    EXPECT_EQ(stats.first_invalid.light_path > 0, integrator == Integrator::lvc);
    EXPECT_EQ(stats.first_invalid.light_paths, 256u);
    const SampleTrace trace = first_traced_again(scene, path, stats);
    EXPECT_FALSE(trace.valid());
    const auto first = first_not_finite(trace);
    ASSERT_TRUE(first.has_value());
    EXPECT_TRUE(first->on_light_path);
  }
}

TEST(FaultInjection, ALightPathThatIsTooBrightForTheFilmIsToldFromOneThatIsNotFinite) {
  const auto scene = lit_floor(1e25f);
  for (const Integrator integrator : {Integrator::light, Integrator::lvc}) {
    SCOPED_TRACE(to_string(integrator));
    PathSettings path;
    path.integrator = integrator;
    const TraceStats stats = trace_splats(scene, path);
    ASSERT_GT(stats.bright_splats, 0u);
    EXPECT_EQ(stats.bright_splats, stats.invalid_splats);
    const SampleTrace trace = first_traced_again(scene, path, stats);
    EXPECT_FALSE(trace.valid());
    const auto first = first_not_finite(trace);
    ASSERT_TRUE(first.has_value());
    EXPECT_NE(first->quantity.find("more than splats can be"), std::string::npos) << first->quantity;
  }
}

}  // namespace
}  // namespace helio::test
