// Pictures that draw on earlier ones against those that do not.
#include <gtest/gtest.h>

#include <cmath>

#include "moments.h"
#include "renderer/metrics/error_metrics.h"
#include "tests/support/loop_views.h"
#include "tests/support/own_scenes.h"
#include "z_test.h"

namespace helio::test {
namespace {

RenderSettings settings_of(RenderMode mode, std::uint64_t seed, int side) {
  RenderSettings settings;
  settings.width = settings.height = side;
  settings.mode = mode;
  settings.seed = seed;
  return settings;
}

// The mean over the picture, at the end of a path of a few turns and a step to the side, and after a rest.
TEST(Reuse, TheMeanIsNotBiased) {
  const auto scene = load_own_scene("cornell-glossy");
  ASSERT_TRUE(scene);
  const CameraPose home = camera_pose(scene->description().cameras.at(0));
  RenderEngine engine(2);
  Moments fresh, moving, resting;
  for (std::uint64_t seed = 1; seed <= 64; ++seed) {
    LoopViews plain(engine, scene, settings_of(RenderMode::pt, 1000 + seed, 48));
    fresh.add(mean_radiance(plain.render(home, 64)));
    LoopViews views(engine, scene, settings_of(RenderMode::combined, seed, 48));
    for (int step = 4; step > 0; --step) views.render(turned_and_shifted(home, step, 0.01 * step), 32);
    moving.add(mean_radiance(views.render(home, 4)));
    resting.add(mean_radiance(views.render(home, 64)));
  }
  for (const Moments& reused : {moving, resting}) {
    const double difference = reused.mean() - fresh.mean();
    const double error = std::sqrt(reused.variance_of_mean() + fresh.variance_of_mean());
    std::printf("bias %+.3f %% +- %.3f %%\n", 100 * difference / fresh.mean(), 100 * error / fresh.mean());
    EXPECT_LT(std::abs(difference), 0.002 * fresh.mean() + 3 * error);
  }
}

// A thousand tiny moves, out and back, a sample each; then a rest.
TEST(Reuse, AThousandTinyMovesLeaveAPictureThatIsTrueAndRich) {
  const auto scene = load_own_scene("cornell-box");
  ASSERT_TRUE(scene);
  const CameraPose home = camera_pose(scene->description().cameras.at(0));
  constexpr int kSide = 48;
  RenderEngine engine(2);
  LoopViews views(engine, scene, settings_of(RenderMode::reproject, 1, kSide));
  views.render(home, 256);
  for (int i = 1; i <= 1000; ++i) {
    const double out = i <= 500 ? i : 1000 - i;
    views.render(turned_and_shifted(home, 0.01 * out, 0.0002 * out), 1);
  }
  const ViewPicture& back = views.render(home, 64);
  double samples = 0;
  for (const float n : back.samples) samples += n;
  samples /= double(back.samples.size());
  std::printf("%.0f effective samples of 256 + 64\n", samples);
  EXPECT_GT(samples, 0.5 * 256 + 64);

  LoopViews fresh(engine, scene, settings_of(RenderMode::pt, 77, kSide));
  const ViewPicture& truth = fresh.render(home, 4096);
  Estimate rendering{kSide, kSide, {}, {}}, reference{kSide, kSide, {}, {}};
  for (std::size_t i = 0; i < back.samples.size(); ++i) {
    const auto at = [i](const std::vector<float>(&channels)[3]) {
      return V3d(channels[0][i], channels[1][i], channels[2][i]);
    };
    rendering.mean.push_back(at(back.radiance));
    rendering.variance.push_back(at(back.variance));
    reference.mean.push_back(at(truth.radiance));
    reference.variance.push_back(at(truth.variance));
  }
  const ZTestResult result = z_test(rendering, reference);
  // One seed, of which every tile is a test: at one time in its making it stood at 1.11 of its bound.
  EXPECT_GE(result.pixels_inside, kLeastShare - 0.0025) << result.to_string();
  EXPECT_LE(result.worst_tile, 1.5) << result.to_string();
}

// Reported over true error right after a turn and a step, and after more samples. A handful of pixels, at edges of
// lights and where light is rare, make both: at 48x48 it is 0.91 to 1.43, at 64x64 0.78 to 0.99, so this bound only
// catches what is wrong altogether; helio_bench reuse measures it in larger pictures.
TEST(Reuse, TheReportedErrorHoldsAfterAMove) {
  RenderEngine engine(2);
  for (const char* name : {"cornell-box", "cornell-glossy", "cornell-spheres"}) {
    const auto scene = load_own_scene(name);
    ASSERT_TRUE(scene);
    const CameraPose home = camera_pose(scene->description().cameras.at(0));
    constexpr int kSide = 48;
    LoopViews fresh(engine, scene, settings_of(RenderMode::pt, 77, kSide));
    const ViewPicture truth = fresh.render(home, 4096);
    for (const auto& [degrees, shift] : {std::pair(5.0, 0.0), std::pair(0.0, 0.1)}) {
      for (const std::uint32_t samples : {2u, 32u}) {
        double reported = 0, squared = 0;
        for (std::uint64_t seed = 1; seed <= 5; ++seed) {
          LoopViews views(engine, scene, settings_of(RenderMode::combined, seed, kSide));
          views.render(turned_and_shifted(home, degrees, shift), 256);
          const ViewPicture& moved = views.render(home, samples);
          squared += squared_error(moved.view(), truth.view())->mse;
          for (int c = 0; c < 3; ++c) {
            for (const float v : moved.variance[c]) reported += double(v) / (3.0 * kSide * kSide);
          }
        }
        const double ratio = std::sqrt(reported / squared);
        std::printf("%s turn %g shift %g samples %u: reported over true error %.3f\n", name, degrees, shift, samples,
                    ratio);
        EXPECT_GT(ratio, 0.7);
        EXPECT_LT(ratio, 1.7);
      }
    }
  }
}

}  // namespace
}  // namespace helio::test
