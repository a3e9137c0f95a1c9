// Hard case 5: a caustic seen in a mirror. Light reaches the floor by a glass ball and the floor is seen by a mirror: the
// path tracer finds such paths only by hitting the lamp by chance. The result says so through its variance.
#include <gtest/gtest.h>

#include "renderer/film/estimate/resolve.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kWidth = 24, kHeight = 16, kSeeds = 8;

enum class Wall { mirror, window };

// At z = 0 a black wall with an opening that holds a mirror or nothing. Before it a floor, a lamp that the ball sees as
// a degree or so, and (or not) the ball, of glass. The window shows the same world once more, mirrored.
SceneDescription scene_of(Wall wall, bool ball) {
  SceneDescription scene;
  Material mirror;
  mirror.base_color = Rgb(1, 1, 1);
  mirror.metallic = 1;
  mirror.roughness = 0;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f)), lambert(Rgb(0, 0, 0), Rgb(900, 900, 900)), glass(1.5f), mirror,
                     lambert(Rgb(0, 0, 0))};
  for (const float side : {1.0f, -1.0f}) {
    if (side < 0 && wall == Wall::mirror) break;
    add_mesh(scene, quad({-4, 0, 1.5f * side}, {8, 0, 0}, {0, 0, 7 * side}, 0));
    add_sphere(scene, {0.6f, 5, 3 * side}, 0.06f, 1);
    if (ball) add_sphere(scene, {0, 0.75f, 3 * side}, 0.5f, 2);
  }
  // So low, and the floor so far away, that the lamp's own image in the mirror lights nothing: from the floor's edge it
  // stands behind a height of 1.67.
  const float top = 1.35f;
  if (wall == Wall::mirror) add_mesh(scene, quad({-1, 0, 0}, {2, 0, 0}, {0, top, 0}, 3));
  add_mesh(scene, quad({-9, 0, 0}, {8, 0, 0}, {0, 9, 0}, 4));
  add_mesh(scene, quad({1, 0, 0}, {8, 0, 0}, {0, 9, 0}, 4));
  add_mesh(scene, quad({-1, top, 0}, {2, 0, 0}, {0, 9 - top, 0}, 4));
  return scene;
}

struct Seen {
  double mean = 0;
  double reported = 0;   // squared error of a picture, by its own account
  double spread = 0;     // half the squared differences between pictures of two seeds, which expects the same
  double brightest = 0;  // at least: of the samples
};

// Onto the floor below the ball, as the opening shows it.
Seen over_seeds(Wall wall, bool ball) {
  const auto scene = build(scene_of(wall, ball));
  const CameraPose pose = camera_at({0, 2.2, 4.8}, {-0.1, 0, -3}, 10);
  Seen seen;
  std::vector<double> last(std::size_t(kWidth) * kHeight);
  for (int seed = 0; seed < kSeeds; ++seed) {
    PathSettings settings;
    settings.seed = std::uint64_t(seed) + 1;
    settings.max_segments = 40;
    const Film film = render(*scene, pose, kWidth, kHeight, 128, settings);
    const FilmError error = estimate_error(film, film.bounds());
    EXPECT_TRUE(error.known);
    seen.reported += error.rmse * error.rmse / kSeeds;
    std::size_t i = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x, ++i) {
        const HalfPixel &a = film.half(0, x, y), &b = film.half(1, x, y);
        const double value = 0.5 * (a.sum[0] / a.count + b.sum[0] / b.count);
        seen.mean += value / (kSeeds * kWidth * kHeight);
        if (a.sum[0] > 0) seen.brightest = std::max(seen.brightest, a.sum_squares(0) / a.sum[0]);
        if (seed % 2 == 1) seen.spread += (value - last[i]) * (value - last[i]) / (kSeeds * kWidth * kHeight);
        last[i] = value;
      }
    }
  }
  return seen;
}

TEST(CausticInMirror, IsUnclampedAndItsVarianceIsTold) {
  const Seen caustic = over_seeds(Wall::mirror, true), plain = over_seeds(Wall::mirror, false);
  // The lamp's 900, halved by the floor, stands in single samples.
  EXPECT_GT(caustic.brightest, 100);
  // The error that is told is the error there is, far above that of the same floor without the ball.
  EXPECT_GT(caustic.reported, 25 * plain.reported);
  EXPECT_GT(caustic.reported, 0.4 * caustic.spread);
  EXPECT_LT(caustic.reported, 2.5 * caustic.spread);
  // And the mean is right: a mirror is a window onto the mirrored world.
  const Seen window = over_seeds(Wall::window, true);
  const double error = std::sqrt((caustic.reported + window.reported) / (kSeeds * kWidth * kHeight));
  EXPECT_NEAR(caustic.mean, window.mean, 3 * error + 1e-3 * window.mean);
  EXPECT_LT(error, 0.1 * window.mean) << "or the line above says nothing";
}

}  // namespace
}  // namespace helio::test
