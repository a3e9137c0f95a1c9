// Hard case 4: lights that are far apart in brightness, close to a surface, or very small.
#include <gtest/gtest.h>

#include <cstring>

#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

// `rounding`: relative, beside three standard errors.
void expect_mean(const Film& film, double expected, const char* what, double rounding = 2e-4) {
  const MeanEstimate e = mean_of(film);
  EXPECT_NEAR(e.mean.x, expected, 3 * e.standard_error.x + rounding * expected) << what;
  EXPECT_LE(e.standard_error.x, 0.01 * expected) << what;
}

// Two closed rooms of one scene whose walls emit 1e9 and 1e-6 and reflect a half: three segments see 1.75 of that in
// either, whatever the other is.
TEST(LightRange, RoomsOfABillionAndAMillionthKeepTheirOwnLight) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f), Rgb(1e9f, 1e9f, 1e9f)),
                     lambert(Rgb(0.5f, 0.5f, 0.5f), Rgb(1e-6f, 1e-6f, 1e-6f))};
  for (Material& material : scene.materials) material.double_sided = false;
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0, true));
  add_mesh(scene, box({9, -1, -1}, {11, 1, 1}, 1, true));
  const auto built = build(std::move(scene));
  PathSettings settings;
  settings.max_segments = 3;
  settings.roulette_from = 100;
  expect_mean(render(*built, camera_at({0.2, 0.1, 0.3}, {1, 0.4, 0.2}, 90), 32, 32, 256, settings), 1.75e9, "bright");
  expect_mean(render(*built, camera_at({10.2, 0.1, 0.3}, {11, 0.4, 0.2}, 90), 32, 32, 256, settings), 1.75e-6, "dim");
}

// A point light at height h over a floor gives I h / (r^2 + h^2)^1.5 at distance r, on the floor as in a corner of
// three walls at h from each. Light is gathered where rays start, up to 1.2e-5 above the floor of these scenes
// (surface.h), so that it is seen that much lower: 12 % at h = 1e-4.
TEST(LightRange, PointLightAlmostOnASurfaceAndInACorner) {
  for (const double h : {1e-2, 1e-3, 1e-4}) {
    for (const bool corner : {false, true}) {
      SceneDescription scene;
      scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
      add_mesh(scene, quad({0, 0, 5}, {5, 0, 0}, {0, 0, -5}, 0));
      if (corner) {
        add_mesh(scene, quad({0, 0, 0}, {5, 0, 0}, {0, 5, 0}, 0));
        add_mesh(scene, quad({0, 0, 0}, {0, 5, 0}, {0, 0, 5}, 0));
      }
      PunctualLight light;
      light.position = corner ? V3d(h, h, h) : V3d(1, h, 1);
      light.intensity = Rgb(1e4f, 1e4f, 1e4f);
      scene.lights = {light};
      const V3d seen = corner ? V3d(0.6, 0, 0.8) : V3d(1.6, 0, 1.8);
      PathSettings settings;
      settings.max_segments = 2;
      const double across = corner ? (0.6 - h) * (0.6 - h) + (0.8 - h) * (0.8 - h) : 1;
      const double expected = 0.5 / M_PI * 1e4 * h / std::pow(across + h * h, 1.5);
      expect_mean(render(*build(std::move(scene)), camera_at(seen + V3d(0, 2, 0), seen, 0.1), 8, 8, 16, settings),
                  expected, corner ? "corner" : "floor", 2e-4 + 1.2e-5 / h);
    }
  }
}

// A sun of half a degree: one texel of a map of 720 x 360. It lights a floor with radiance x solid angle x cosine.
TEST(LightRange, SunInOneTexelLightsAFloor) {
  constexpr int kWidth = 720, kHeight = 360, kRow = 90, kColumn = 200;
  constexpr double kSun = 1e6;
  Image image;
  image.width = kWidth;
  image.height = kHeight;
  image.channels = 3;
  image.format = TexelFormat::f32;
  std::vector<float> texels(std::size_t(3) * kWidth * kHeight, 0.0f);
  for (int c = 0; c < 3; ++c) texels[(std::size_t(kRow) * kWidth + kColumn) * 3 + std::size_t(c)] = float(kSun);
  image.texels.resize(texels.size() * sizeof(float));
  std::memcpy(image.texels.data(), texels.data(), image.texels.size());
  SceneDescription scene;
  scene.images = {image};
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, quad({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, 0));
  scene.environment = Environment{};
  scene.environment->image = 0;
  PathSettings settings;
  settings.max_segments = 2;
  const double step = M_PI / kHeight, theta = (kRow + 0.5) * step;
  const double solid_angle = 2 * M_PI / kWidth * (std::cos(theta - step / 2) - std::cos(theta + step / 2));
  expect_mean(render(*build(std::move(scene)), camera_at({0, 2, 0}, {0, 0, 0}, 5), 16, 16, 256, settings),
              0.5 / M_PI * kSun * solid_angle * std::cos(theta), "sun");
}

}  // namespace
}  // namespace helio::test
