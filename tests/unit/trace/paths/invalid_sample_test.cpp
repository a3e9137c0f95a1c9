// Samples that are not finite are counted with their place and never enter the film, however their path ended.
#include <gtest/gtest.h>

#include "renderer/trace/paths/sample_trace.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
constexpr int kSize = 8;
constexpr std::uint32_t kSamples = 16;

const CameraPose kPose = camera_at({0, 1, 2}, {0, 0, 0}, 10);  // sees nothing but floor

struct Rendered {
  Film film{kSize, kSize};
  TraceStats stats;
};

// Two halves of kSamples each.
Rendered rendered(const RenderScene& scene, const PathSettings& settings) {
  Rendered result;
  const Camera camera(kPose, kSize, kSize, scene.origin());
  for (int half = 0; half < kHalves; ++half) {
    EXPECT_TRUE(trace_window(scene, camera, settings, {half, 0, kSamples}, result.film.bounds(), CancelToken(),
                             result.film, result.stats));
  }
  return result;
}

SceneDescription floor_of(const Material& material) {
  SceneDescription scene;
  scene.materials = {material};
  add_mesh(scene, quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0));
  return scene;
}

// All of them invalid, none in the film; the first is told again by its place.
void expect_all_invalid(const RenderScene& scene, const PathSettings& settings) {
  const Rendered result = rendered(scene, settings);
  EXPECT_EQ(result.stats.invalid_samples, std::uint64_t(kSize * kSize * kHalves) * kSamples);
  EXPECT_EQ(result.stats.first_invalid, (InvalidSample{0, 0, 0, 0}));
  for (int half = 0; half < kHalves; ++half) {
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        ASSERT_EQ(result.film.half(half, x, y).count, 0u);
        ASSERT_EQ(result.film.invalid(half, x, y), kSamples);
      }
    }
  }
  SampleTrace trace;
  trace.width = trace.height = kSize;
  trace.sample = result.stats.first_invalid;
  ASSERT_TRUE(trace_sample(scene, Camera(kPose, kSize, kSize, scene.origin()), settings, CancelToken(), trace));
  EXPECT_FALSE(is_finite(trace.radiance));
  EXPECT_TRUE(first_not_finite(trace).has_value());
}

class InvalidSamples : public testing::TestWithParam<bool> {
 protected:
  PathSettings settings() const {
    PathSettings settings;
    settings.general_kernel = GetParam();
    settings.roulette_from = 1;
    return settings;
  }
};

// Nothing shines: only the throughput tells. Roulette is played at the first vertex, where it would end every twentieth
// path of a throughput that it cannot compare.
TEST_P(InvalidSamples, ThroughputThatIsNotFiniteCountsWithoutAnyLight) {
  for (const Rgb& albedo : {Rgb(kNan, 0.5f, 0.5f), Rgb(0.5f, kNan, 0.5f), Rgb(0.5f, 0.5f, kNan), Rgb(0.5f, kInf, 0)}) {
    SCOPED_TRACE(albedo);
    const auto scene = build(floor_of(lambert(albedo)));
    for (const RouletteRule rule : {RouletteRule::root, RouletteRule::throughput}) {
      PathSettings playing = settings();
      playing.roulette = rule;
      expect_all_invalid(*scene, playing);
    }
    PathSettings without = settings();
    without.roulette_from = 5;
    expect_all_invalid(*scene, without);
  }
}

// The last vertex scatters nothing: an albedo that is not a number is no part of the sample.
TEST_P(InvalidSamples, WhatIsNotUsedDoesNotCount) {
  PathSettings one = settings();
  one.max_segments = 1;
  const Rendered result = rendered(*build(floor_of(lambert(Rgb(kNan, kNan, kNan)))), one);
  EXPECT_EQ(result.stats.invalid_samples, 0u);
  EXPECT_EQ(result.film.half(1, 3, 3).count, kSamples);
}

// 2e38 W / sr, and no more than 0.7 units to what the camera sees: more than 4e38 W / m^2, which no float holds.
TEST_P(InvalidSamples, InfiniteArrivalOfAPointLightCounts) {
  SceneDescription scene = floor_of(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  PunctualLight light;
  light.position = {0, 0.3, 0};
  light.intensity = Rgb(2e38f, 2e38f, 2e38f);
  scene.lights = {light};
  SceneDescription shaded = scene;
  PathSettings direct = settings();
  direct.max_segments = 2;
  expect_all_invalid(*build(std::move(scene)), direct);

  // A plate under the lamp, out of the camera's sight, keeps it from all of the floor.
  add_mesh(shaded, quad({-0.1f, 0.28f, 0.1f}, {0.2f, 0, 0}, {0, 0, -0.2f}, 0));
  EXPECT_EQ(rendered(*build(std::move(shaded)), direct).stats.invalid_samples, 0u);
}

INSTANTIATE_TEST_SUITE_P(, InvalidSamples, testing::Bool(),
                         [](const auto& info) { return info.param ? "general_kernel" : "plain_kernel"; });

TEST(Roulette, EndsNoPathWhoseThroughputIsNotFinite) {
  for (const RouletteRule rule : {RouletteRule::root, RouletteRule::throughput}) {
    for (const float odd : {kNan, kInf}) {
      for (const Rgb& throughput : {Rgb(odd, 0, 0.5f), Rgb(0.5f, odd, 0), Rgb(0, 0.5f, odd)}) {
        const float survival = survival_probability(rule, throughput);
        EXPECT_TRUE(survives(0, survival) && survives(0.5f, survival) && survives(kOneMinusEpsilon, survival));
      }
    }
  }
}

TEST(Roulette, SurvivesWithTheThroughputOrItsRootAndAtMost95Percent) {
  EXPECT_EQ(survival_probability(RouletteRule::root, Rgb(0.01f, 0.25f, 0)), 0.5f);
  EXPECT_EQ(survival_probability(RouletteRule::throughput, Rgb(0.01f, 0.25f, 0)), 0.25f);
  EXPECT_EQ(survival_probability(RouletteRule::root, Rgb(1, 3e38f, 3e38f)), 0.95f);
  EXPECT_TRUE(survives(0.2f, 0.25f));
  EXPECT_FALSE(survives(0.25f, 0.25f));
  EXPECT_FALSE(survives(0, 0));
}

}  // namespace
}  // namespace helio::test
