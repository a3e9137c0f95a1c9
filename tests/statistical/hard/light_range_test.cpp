// Hard case 4: lights that are far apart in brightness, close to a surface, or very small.
#include "tests/statistical/hard/light_range_scenes.h"

namespace helio::test {
namespace {

// `rounding`: relative, beside three standard errors.
void expect_mean(const Film& film, double expected, const char* what, double rounding = 2e-4) {
  const MeanEstimate e = mean_of(film);
  EXPECT_NEAR(e.mean.x, expected, 3 * e.standard_error.x + rounding * expected) << what;
  EXPECT_LE(e.standard_error.x, 0.01 * expected) << what;
}

TEST(LightRange, RoomsOfABillionAndAMillionthKeepTheirOwnLight) {
  const auto built = build(bright_and_dim_room());
  PathSettings settings;
  settings.max_segments = 3;
  settings.roulette_from = 100;
  expect_mean(render(*built, in_room_at(0), 32, 32, 256, settings), 1.75e9, "bright");
  expect_mean(render(*built, in_room_at(10), 32, 32, 256, settings), 1.75e-6, "dim");
}

// A point light at height h over a floor gives I h / (r^2 + h^2)^1.5 at distance r, on the floor as in a corner of
// three walls at h from each. Light is gathered where rays start, up to 1.2e-5 above the floor of these scenes
// (surface.h), so that it is seen that much lower: 12 % at h = 1e-4.
TEST(LightRange, PointLightAlmostOnASurfaceAndInACorner) {
  for (const double h : {1e-2, 1e-3, 1e-4}) {
    for (const bool corner : {false, true}) {
      PathSettings settings;
      settings.max_segments = 2;
      const double across = corner ? (0.6 - h) * (0.6 - h) + (0.8 - h) * (0.8 - h) : 1;
      const double expected = 0.5 / M_PI * 1e4 * h / std::pow(across + h * h, 1.5);
      expect_mean(render(*build(light_almost_on_surface(h, corner)), beside_light(corner), 8, 8, 16, settings),
                  expected, corner ? "corner" : "floor", 2e-4 + 1.2e-5 / h);
    }
  }
}

// A sun of half a degree: one texel of a map of 720 x 360. It lights a floor with radiance x solid angle x cosine.
TEST(LightRange, SunInOneTexelLightsAFloor) {
  PathSettings settings;
  settings.max_segments = 2;
  const double step = M_PI / OneTexelSun::kHeight, theta = (OneTexelSun::kRow + 0.5) * step;
  const double solid_angle =
      2 * M_PI / OneTexelSun::kWidth * (std::cos(theta - step / 2) - std::cos(theta + step / 2));
  expect_mean(render(*build(OneTexelSun::scene()), OneTexelSun::pose(), 16, 16, 256, settings),
              0.5 / M_PI * OneTexelSun::kRadiance * solid_angle * std::cos(theta), "sun");
}

}  // namespace
}  // namespace helio::test
