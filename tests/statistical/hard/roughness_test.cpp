// Hard case 2: roughness around the limit below which a lobe is a delta (kDeltaAlpha).
#include <gtest/gtest.h>

#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr double kAlphas[] = {0, 1e-4, 1e-3, 0.0099, 0.01, 0.5, 1};

Material metal(double alpha) {
  Material m;
  m.base_color = Rgb(1, 1, 1);
  m.metallic = 1;
  m.roughness = float(std::sqrt(alpha));  // glTF: alpha = roughness^2
  return m;
}

// A white metal in a white furnace: 1, for its facets light one another.
TEST(Roughness, MetalLosesNothingInAFurnace) {
  for (const double alpha : kAlphas) {
    SceneDescription scene;
    scene.materials = {metal(alpha)};
    add_sphere(scene, {0, 0, 0}, 1, 0);
    scene.environment = Environment{};
    TraceStats stats;
    const Film film =
        render(*build(std::move(scene)), camera_at({0, 0, 4}, {0, 0, 0}, 28), 24, 24, 128, {}, &stats);
    const MeanEstimate e = mean_of(film);
    EXPECT_EQ(stats.invalid_samples, 0u) << alpha;
    EXPECT_NEAR(e.mean.x, 1, 3 * e.standard_error.x + 2e-3) << alpha;
  }
}

// A mirror shows a lamp that covers a third of what it reflects. Lobes of alpha <= 0.01 blur its edge by far less than
// the lamp: they show as much light as the smooth one, whether they are sampled as deltas or as lobes.
TEST(Roughness, AlmostSmoothMetalMirrorsAsTheSmoothOneDoes) {
  const auto seen = [](double alpha, bool grazing) {
    SceneDescription scene;
    scene.materials = {metal(alpha), lambert(Rgb(0, 0, 0), Rgb(7, 5, 3))};
    add_mesh(scene, quad({-20, 0, 20}, {40, 0, 0}, {0, 0, -40}, 0));
    add_mesh(scene, quad({-1, grazing ? 0.05f : 0.5f, -8}, {2, 0, 0}, {0, grazing ? 0.2f : 2.0f, 0}, 1));
    const V3d eye = grazing ? V3d(0, 0.15, 8) : V3d(0, 1.5, 2);
    return mean_of(render(*build(std::move(scene)), camera_at(eye, {0, 0, grazing ? 0.0 : -2.0}, grazing ? 2 : 25), 32,
                          32, 256));
  };
  for (const bool grazing : {false, true}) {
    const MeanEstimate smooth = seen(0, grazing);
    ASSERT_GT(smooth.mean.x, 0.1);
    for (const double alpha : {1e-4, 1e-3}) {
      const MeanEstimate e = seen(alpha, grazing);
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(e.mean[c], smooth.mean[c],
                    3 * (e.standard_error[c] + smooth.standard_error[c]) + 0.005 * smooth.mean[c])
            << alpha << (grazing ? " grazing" : "");
      }
    }
  }
}

}  // namespace
}  // namespace helio::test
