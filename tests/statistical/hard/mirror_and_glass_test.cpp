// Hard case 5: long chains of mirrors, glass in glass.
#include <gtest/gtest.h>

#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

// Between two parallel mirrors 1 apart, a ray at angle a to their normal meets 64 of them on its way to a lamp at
// 64 tan(a): of its light F^64 is left, F = f0 + (1 - f0) (1 - cos a)^5 (Schlick 1994). One segment fewer sees nothing.
TEST(Mirrors, SixtyFourBouncesBetweenParallelOnes) {
  const double slope = 0.2, f0 = 0.98, length = 64 * slope;
  SceneDescription scene;
  Material mirror;
  mirror.base_color = Rgb(float(f0), float(f0), float(f0));
  mirror.metallic = 1;
  mirror.roughness = 0;
  scene.materials = {mirror, lambert(Rgb(0, 0, 0), Rgb(5, 5, 5))};
  const float far = float(length);
  add_mesh(scene, quad({-1, 0, 5}, {far + 2, 0, 0}, {0, 0, -10}, 0));
  add_mesh(scene, quad({-1, 1, -5}, {far + 2, 0, 0}, {0, 0, 10}, 0));
  add_mesh(scene, quad({far, 0.01f, -5}, {0, 0.98f, 0}, {0, 0, 10}, 1));
  const auto built = build(std::move(scene));
  const CameraPose pose = camera_at({0, 0.5, 0}, {slope, 1.5, 0}, 0.1);
  PathSettings settings;
  settings.roulette_from = 1000;
  settings.max_segments = 65;
  const double cosine = 1 / std::sqrt(1 + slope * slope);
  const double fresnel = f0 + (1 - f0) * std::pow(1 - cosine, 5);
  const MeanEstimate lit = mean_of(render(*built, pose, 16, 16, 4, settings));
  EXPECT_NEAR(lit.mean.x, 5 * std::pow(fresnel, 64), 1e-3 * 5);
  settings.max_segments = 64;
  EXPECT_EQ(mean_of(render(*built, pose, 16, 16, 4, settings)).mean.x, 0);
}

// Smooth glass in smooth glass, also where light is totally reflected at the inner side, neither absorbs nor emits.
TEST(Glass, InsideGlassIsInvisibleInAFurnace) {
  for (const float inner : {1.0f, 1.2f, 2.4f}) {
    SceneDescription scene;
    scene.materials = {glass(1.5f), glass(inner)};
    add_sphere(scene, {0, 0, 0}, 1, 0);
    add_sphere(scene, {0.2f, 0.1f, 0}, 0.5f, 1);
    scene.environment = Environment{};
    PathSettings settings;
    settings.max_segments = 200;
    settings.roulette_from = 200;
    const MeanEstimate e = mean_of(render(*build(std::move(scene)), camera_at({2.5, 1.5, 3}, {0, 0, 0}, 35), 24, 24, 64,
                                          settings));
    EXPECT_NEAR(e.mean.x, 1, 0.005) << inner;
    EXPECT_NEAR(e.mean.x, 1, 3 * e.standard_error.x + 1e-3) << inner;
  }
}

}  // namespace
}  // namespace helio::test
