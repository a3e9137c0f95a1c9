// What samples leave for later pictures: where their light came from, and how much of it depends on the view.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "renderer/film/history/history_source.h"
#include "renderer/trace/paths/path_integrator.h"
#include "renderer/trace/scene/scene_data.h"
#include "tests/support/directions.h"
#include "tests/support/test_scenes.h"
#include "tests/unit/trace/bsdf/bsdf_questions.h"

namespace helio::test {
namespace {

constexpr int kSide = 16;

Material coated(float base, float roughness) {
  Material material;
  material.base_color = Rgb(base, base, base);
  material.metallic = 0;
  material.roughness = roughness;
  return material;
}

struct Told {
  double share = 0;     // mean over the pixels
  double towards = 0;   // of the directions, those within 15 degrees of one
  double anywhere = 0;  // and those of what shines
  double nowhere = 0;   // and of delta lobes, or of nothing
};

// Of a picture as a source has it; whatever is seen is seen by all pixels.
Told told_by(const SceneDescription& description, const CameraPose& pose, Integrator integrator, std::uint32_t samples,
             const V3f& towards, int max_segments = 12, std::optional<Technique> technique = {}) {
  const auto scene = build(description);
  const bool splats = integrator != Integrator::path;
  Film film(kSide, kSide, {.history = true, .splats = splats});
  const Camera camera(pose, kSide, kSide, scene->origin());
  PathSettings settings;
  settings.integrator = integrator;
  settings.max_segments = max_segments;
  settings.technique = technique;
  TraceStats stats;
  for (int h = 0; h < kHalves; ++h)
    EXPECT_TRUE(trace_window(*scene, camera, settings, {h, 0, samples}, film.bounds(), {}, film, stats));
  HistorySource source(kSide, kSide);
  source.gather(film, film.bounds(), film.bounds());
  Told told;
  constexpr double kPixels = kSide * kSide, kDirections = kPixels * kHalves * DirectionReservoir::kPlaces;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const DirectionReservoir& reservoir = source.directions(x, y);
      for (int h = 0; h < kHalves; ++h) told.share += double(reservoir.share(h)) / (kHalves * kPixels);
      for (const std::uint32_t direction : directions_in(reservoir)) {
        if (direction == DirectionReservoir::kAny) {
          told.anywhere += 1 / kDirections;
        } else if (direction == DirectionReservoir::kNone) {
          told.nowhere += 1 / kDirections;
        } else if (dot(unpack_direction<DirectionReservoir::kAxisBits>(direction), towards) > 0.966f) {
          told.towards += 1 / kDirections;
        }
      }
    }
  }
  return told;
}

// A floor seen from far away, under two lamps far away, one of them where the floor mirrors it.
TEST(DirectionRecorder, TheShareIsWhatLobesBring) {
  SceneDescription description;
  description.materials = {coated(0.3f, 0.6f)};
  add_mesh(description, quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, 0));
  const V3d mirrored = V3d(-0.6, 1, 0).normalized(), other = V3d(0.2, 1, 0.9).normalized();
  for (const V3d& towards : {mirrored, other}) {
    PunctualLight light;
    light.kind = PunctualKind::directional;
    light.direction = -towards;
    description.lights.push_back(light);
  }
  const CameraPose pose = camera_at(V3d(0.6, 1, 0) * 40, {0, 0, 0}, 0.5);
  const SurfaceParams params = build(description)->impl().materials[0].params;
  const Frame frame(V3f(0, 1, 0));
  const V3f wo = frame.to_local(V3f(V3d(0.6, 1, 0).normalized()));
  double all = 0, varies = 0, counts[2] = {};
  for (int i = 0; i < 2; ++i) {
    const V3f wi = frame.to_local(V3f(i == 0 ? mirrored : other));
    const Rgb f = evaluate_bsdf(params, wo, wi).f_cos;
    const double share = double(varying_share(f, matte_cos(params, wo, wi)));
    all += double(luminance(f));
    varies += share * double(luminance(f));
    counts[i] = double(DirectionReservoir::counting(float(share)) * luminance(f));
  }
  ASSERT_GT(counts[0], 1.5 * counts[1]) << "of the brightness they are as 3 to 2";
  const Told told = told_by(description, pose, Integrator::path, 64, V3f(mirrored), 2);
  EXPECT_NEAR(told.share, varies / all, 0.01);
  EXPECT_NEAR(told.towards, counts[0] / (counts[0] + counts[1]), 0.05);
  EXPECT_EQ(told.nowhere, 0);
}

// A coated floor below a lamp, beside a white wall.
SceneDescription lit_floor(const Material& floor) {
  SceneDescription description;
  description.materials = {floor, lambert(Rgb(0.9f, 0.9f, 0.9f)), lambert(Rgb(0, 0, 0), Rgb(8, 8, 8))};
  add_mesh(description, quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, 0));
  add_mesh(description, quad({-1.5f, 0, -2}, {0, 4, 0}, {0, 0, 4}, 1));
  add_mesh(description, quad({0.3f, 2, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f}, 2));
  return description;
}
const V3f kLamp = normalize(V3f(0.9f, 2, 0));  // from what is seen

// Whichever way paths are put together, with layers and without.
TEST(DirectionRecorder, BidirectionalPathsTellTheSame) {
  Material layered = coated(0.4f, 0.7f);
  layered.layers.clearcoat = 0.7f;
  layered.layers.clearcoat_roughness = 0.4f;
  layered.layers.sheen_color = Rgb(0.2f, 0.2f, 0.2f);
  layered.layers.sheen_roughness = 0.5f;
  for (const Material& floor : {coated(0.4f, 0.5f), layered}) {
    const SceneDescription description = lit_floor(floor);
    const CameraPose pose = camera_at({1, 1, 0.2}, {-0.3, 0, 0}, 20);
    const Told path = told_by(description, pose, Integrator::path, 128, kLamp);
    const Told bdpt = told_by(description, pose, Integrator::bdpt, 128, kLamp);
    std::printf("share %.4f %.4f, towards the lamp %.3f %.3f\n", path.share, bdpt.share, path.towards, bdpt.towards);
    EXPECT_GT(path.share, 0.05);
    EXPECT_NEAR(bdpt.share / path.share, 1, 0.05);
    EXPECT_GT(path.towards, 0.1);
    EXPECT_LT(path.towards, 0.9);
    EXPECT_NEAR(bdpt.towards, path.towards, 0.05);
  }
}

// Light paths alone, with what camera paths find of the same light: that of the lamp itself.
TEST(DirectionRecorder, SplatsTellTheSame) {
  const SceneDescription description = lit_floor(coated(0.1f, 0.5f));
  const CameraPose pose = camera_at({1, 1, 0.2}, {-0.3, 0, 0}, 20);
  const Told path = told_by(description, pose, Integrator::path, 64, kLamp, 2);
  const Told splats = told_by(description, pose, Integrator::bdpt, 512, kLamp, 2, Technique{2, 1, true});
  std::printf("share %.4f %.4f\n", path.share, splats.share);
  EXPECT_GT(path.share, 0.05);
  EXPECT_NEAR(splats.share / path.share, 1, 0.1);
  EXPECT_LT(splats.nowhere, 0.02) << "of halves that no splat has met";
  EXPECT_NEAR(splats.towards, path.towards, 0.04);
}

TEST(DirectionRecorder, MirrorsLampsAndMatteWallsTellWhatTheyAre) {
  SceneDescription description;
  description.environment.emplace().radiance = Rgb(1, 1, 1);
  Material mirror = coated(0, 0);
  mirror.metallic = 1;
  mirror.base_color = Rgb(0.9f, 0.9f, 0.9f);
  description.materials = {mirror};
  add_mesh(description, quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, 0));
  const CameraPose pose = camera_at({0.6, 1, 0}, {0, 0, 0}, 10);
  Told told = told_by(description, pose, Integrator::path, 4, V3f(0, 1, 0));
  EXPECT_EQ(told.nowhere, 1);
  EXPECT_EQ(told.share, 1);

  description.materials = {lambert(Rgb(0, 0, 0), Rgb(2, 2, 2)), mirror};  // beside some mirror
  add_mesh(description, quad({-4, -1, -4}, {0, 0, 8}, {8, 0, 0}, 1));
  told = told_by(description, pose, Integrator::path, 4, V3f(0, 1, 0));
  EXPECT_EQ(told.anywhere, 1);
  EXPECT_EQ(told.share, 0);

  description.materials[0] = lambert(Rgb(0.5f, 0.5f, 0.5f));
  told = told_by(description, pose, Integrator::path, 4, V3f(0, 1, 0));
  EXPECT_EQ(told.anywhere + told.nowhere, 0);
  EXPECT_EQ(told.share, 0);
}

}  // namespace
}  // namespace helio::test
