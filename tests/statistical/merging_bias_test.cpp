// Merging within a radius is biased: the bias that is reported is the one that there is, it falls as the radius does,
// and the reported error has it in.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/support/loop_picture.h"
#include "tests/support/own_scenes.h"
#include "tests/support/small_rooms.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

constexpr int kSide = 48;

double mean_luminance(const LoopPicture& picture) {
  double sum = 0;
  for (std::size_t i = 0; i < picture.channels[0].size(); ++i)
    sum += luminance(Rgb(picture.channels[0][i], picture.channels[1][i], picture.channels[2][i]));
  return sum / double(picture.channels[0].size());
}

class MergingBias : public testing::TestWithParam<Integrator> {
 protected:
  void SetUp() override {
    scene_ = load_own_scene("cornell-box");
    ASSERT_TRUE(scene_);
    view_ = camera_pose(scene_->description().cameras.at(0));
  }
  LoopPicture render(Integrator integrator, double radius, std::uint32_t samples, std::uint64_t seed) {
    RenderSettings settings;
    settings.width = settings.height = kSide;
    settings.integrator = integrator;
    settings.light_cache.radius = radius;
    settings.light_cache.shrinking = 1;
    settings.seed = seed;
    Budget budget;
    budget.samples = samples;
    return render_through_loop(engine_, scene_, settings, budget, view_);
  }
  // Merged within a radius, the picture is what joining makes of it.
  void expect_agreement() {
    ASSERT_TRUE(scene_);
    const LoopPicture joined = render(Integrator::bdpt, 0.003, 512, 3);
    const LoopPicture merged = render(GetParam(), 0.02, 1024, 4);
    const double brightness = mean_luminance(joined), off = mean_luminance(merged) / brightness - 1;
    const FilmError& error = merged.end.progress.error;
    const double noise = std::hypot(joined.end.progress.error.rmse, error.rmse) / kSide / brightness;
    std::printf("  %s: off by %+.3f +- %.3f %%, reported bias %+.3f +- %.3f %%\n", to_string(GetParam()), 100 * off,
                100 * noise, 100 * error.bias / brightness, 100 * error.bias_error / brightness);
    EXPECT_LE(std::fabs(off), 1.5 * std::fabs(error.bias) / brightness + 4 * (noise + error.bias_error / brightness));
    EXPECT_LE(std::fabs(off), 0.02);
  }

  RenderEngine engine_{2};
  std::shared_ptr<const RenderScene> scene_;
  CameraPose view_;
};

// What a disc takes in from around edges.
TEST_P(MergingBias, IsReportedAsItIs) {
  if (GetParam() == Integrator::photon) HELIO_FULL_TIER_ONLY();
  const LoopPicture truth = render(Integrator::path, 0.003, 4096, 1);
  const double brightness = mean_luminance(truth), noise = truth.end.progress.error.rmse / kSide;
  double biases[2];
  for (const int k : {0, 1}) {
    const LoopPicture picture = render(GetParam(), k == 0 ? 0.1 : 0.05, GetParam() == Integrator::vcm ? 512 : 2048, 2);
    const FilmError& error = picture.end.progress.error;
    biases[k] = mean_luminance(picture) - brightness;
    std::printf("  %s, radius %s: off by %+.3f %%, reported %+.3f +- %.3f %%, error %.4f of %.4f\n",
                to_string(GetParam()), k == 0 ? "0.1" : "0.05", 100 * biases[k] / brightness,
                100 * error.bias / brightness, 100 * error.bias_error / brightness, error.rmse, brightness);
    // To first order in the radius.
    EXPECT_NEAR(error.bias, biases[k], 0.25 * std::fabs(biases[k]) + 4 * std::hypot(error.bias_error, noise)) << k;
    if (k == 0) {
      EXPECT_GT(error.bias, 0.65 * biases[k]);
    }
    EXPECT_GE(error.rmse, 0.6 * std::fabs(biases[k]));
  }
  EXPECT_GT(std::fabs(biases[0]), 5 * noise) << "else the test would not tell";
  EXPECT_LT(std::fabs(biases[1]), 0.75 * std::fabs(biases[0]));
}

// What glass and mirrors throw on a floor.
TEST_P(MergingBias, VanishesWhereLightIsFocused) {
  scene_ = load_own_scene("cornell-spheres");
  ASSERT_TRUE(scene_);
  view_ = camera_pose(scene_->description().cameras.at(0));
  expect_agreement();
}

// Walls that mirror a part of the light and scatter the rest: both have to be followed.
TEST_P(MergingBias, SmoothCoatsAreMirrorsToo) {
  HELIO_FULL_TIER_ONLY();
  SceneDescription room = lambert_room();
  room.materials[0].model = MaterialModel::plastic;
  room.materials[0].roughness = 0;
  scene_ = build(std::move(room));
  view_ = camera_at({0, 0, 0.9}, {0, -0.2, -1}, 70);
  expect_agreement();
}

INSTANTIATE_TEST_SUITE_P(Integrators, MergingBias, testing::Values(Integrator::photon, Integrator::vcm),
                         [](const auto& info) { return std::string(to_string(info.param)); });

}  // namespace
}  // namespace helio::test
