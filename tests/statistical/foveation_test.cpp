// Pictures whose samples follow a gaze against pictures without one.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "estimates.h"
#include "moments.h"
#include "tests/support/loop_views.h"
#include "tests/support/own_scenes.h"
#include "tests/support/tier.h"
#include "z_test.h"

namespace helio::test {
namespace {

constexpr int kSide = 48;

RenderSettings settings_of(RenderMode mode, std::uint64_t seed, Foveation foveation) {
  RenderSettings settings = loop_settings(kSide, kSide, mode);
  settings.seed = seed;
  settings.foveation.kind = foveation;
  settings.foveation.viewing_distance = 1;
  return settings;
}

class FoveatedPicture : public testing::TestWithParam<RenderMode> {};

// Every pixel, far from the gaze too.
TEST_P(FoveatedPicture, ARestingGazePassesTheZTest) {
  const auto scene = load_own_scene("cornell-box");
  ASSERT_TRUE(scene);
  const CameraPose home = camera_pose(scene->description().cameras.at(0));
  RenderEngine engine(2);
  LoopViews plain(engine, scene, settings_of(RenderMode::pt, 1000, Foveation::none));
  LoopViews views(engine, scene, settings_of(GetParam(), 7, Foveation::density));
  views.gaze = Gaze{12, 30};
  const Estimate reference = estimate_of(plain.render(home, by_tier(2048, 8192)));
  const ViewPicture& picture = views.render(home, by_tier(8192, 32768));
  const ZTestResult result = z_test(estimate_of(picture), reference);
  EXPECT_TRUE(result.passed()) << result.to_string();
}

// A gaze that jumps while it renders, to places that do not depend on what is seen there.
TEST_P(FoveatedPicture, AJumpingGazeLeavesTheMeanAlone) {
  const auto scene = load_own_scene("cornell-box");
  ASSERT_TRUE(scene);
  const CameraPose home = camera_pose(scene->description().cameras.at(0));
  RenderEngine engine(2);
  Moments fresh, jumping;
  for (int seed = 1; seed <= by_tier(16, 64); ++seed) {
    LoopViews plain(engine, scene, settings_of(RenderMode::pt, std::uint64_t(1000 + seed), Foveation::none));
    fresh.add(mean_radiance(plain.render(home, 128)));
    LoopViews views(engine, scene, settings_of(GetParam(), std::uint64_t(seed), Foveation::density));
    views.gaze = Gaze{24, 24};
    views.render(home, 128);
    for (int jump = 1; jump <= 6; ++jump) {
      views.loop().move_gaze(Gaze{double(jump * 29 % kSide), double(jump * 17 % kSide)});
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    jumping.add(mean_radiance(views.settle()));
  }
  const double bias = jumping.mean() / fresh.mean() - 1;
  const double error = std::sqrt(jumping.variance_of_mean() + fresh.variance_of_mean()) / fresh.mean();
  std::printf("%s: bias %+.3f %% +- %.3f %%\n", to_string(GetParam()), 100 * bias, 100 * error);
  EXPECT_LT(error, 0.006);
  EXPECT_LT(std::abs(bias), 3.5 * error);
}

INSTANTIATE_TEST_SUITE_P(Modes, FoveatedPicture, testing::Values(RenderMode::pt, RenderMode::adaptive),
                         [](const auto& info) { return std::string(to_string(info.param)); });

}  // namespace
}  // namespace helio::test
