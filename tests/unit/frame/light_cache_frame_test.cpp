// Integrators that cache light vertices, through the loop: bits, views that follow one another, interruptions.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "tests/support/loop_views.h"
#include "tests/support/own_scenes.h"

namespace helio::test {
namespace {

constexpr Integrator kCaching[] = {Integrator::lvc, Integrator::vcm, Integrator::photon};

class LightCacheFrame : public testing::TestWithParam<Integrator> {
 protected:
  void SetUp() override {
    scene_ = load_own_scene("cornell-spheres");
    ASSERT_TRUE(scene_);
    settings_.width = 100;
    settings_.height = 70;
    settings_.integrator = GetParam();
    settings_.light_cache.radius = 0.02;
    here_ = camera_pose(scene_->description().cameras.at(0));
    there_ = turned_and_shifted(here_, 7, 0.1);
  }
  ViewPicture render(const CameraPose& camera, std::uint32_t samples, int threads = 2,
                     const RenderLoopOptions& options = {}) const {
    RenderEngine engine(threads);
    return LoopViews(engine, scene_, settings_, options).render(camera, samples);
  }
  static double seconds_of(const FrameEnd& end, const std::string& name) {
    for (const PassTime& pass : end.passes) {
      if (pass.pass == name) return pass.seconds;
    }
    return 0;
  }

  std::shared_ptr<const RenderScene> scene_;
  RenderSettings settings_;
  CameraPose here_, there_;
};

TEST_P(LightCacheFrame, ThreadsTilesAndPublishingDoNotChangeABit) {
  const ViewPicture one = render(here_, 7, 1);
  RenderLoopOptions small_tiles;
  small_tiles.tile_size = 32;
  small_tiles.publish_passes = true;
  const ViewPicture four = render(here_, 7, 4, small_tiles);
  EXPECT_TRUE(same_pixels(one, four));
  EXPECT_GT(*std::max_element(one.radiance[0].begin(), one.radiance[0].end()), 0.1f);
  EXPECT_GT(seconds_of(one.end, "trace_lights"), 0);
  EXPECT_EQ(one.end.progress.trace.light_paths, one.end.progress.trace.paths);
  EXPECT_EQ(one.end.progress.trace.light_paths, four.end.progress.trace.light_paths);
}

// The first samples of another view draw on light paths that were traced for the one before, in the same bits.
TEST_P(LightCacheFrame, LightVerticesSurviveACameraMove) {
  RenderEngine engine(2);
  LoopViews views(engine, scene_, settings_);
  views.render(here_, 5);
  const std::size_t kept = views.loop().memory_bytes();
  const ViewPicture moved = views.render(there_, 2);
  const ViewPicture fresh = render(there_, 2);
  EXPECT_TRUE(same_pixels(moved, fresh));
  const TraceStats &with = moved.end.progress.trace, &without = fresh.end.progress.trace;
  EXPECT_LT(with.rays - with.shadow_rays, without.rays - without.shadow_rays) << "no light path is traced again";
  EXPECT_EQ(with.shadow_rays, without.shadow_rays);
  RenderLoopOptions forgetful;
  forgetful.keep_light_vertices = false;
  LoopViews others(engine, scene_, settings_, forgetful);
  others.render(here_, 5);
  const ViewPicture anew = others.render(there_, 2);
  EXPECT_TRUE(same_pixels(anew, fresh));
  EXPECT_GT(anew.end.progress.trace.rays, with.rays) << "what is not kept is traced again";
  // And back, past what was kept.
  const ViewPicture back = views.render(here_, 5), again = render(here_, 5);
  EXPECT_TRUE(same_pixels(back, again));
  EXPECT_LE(views.loop().memory_bytes(), kept + kept / 2) << "two passes are kept, however often the camera moves";
}

TEST_P(LightCacheFrame, AnotherSeedOrSceneBeginsAnew) {
  RenderEngine engine(2);
  LoopViews views(engine, scene_, settings_);
  views.render(here_, 2);
  RenderSettings other = settings_;
  other.seed = 99;
  Budget budget;
  budget.samples = 2;
  const ViewPicture reseeded = views.render(here_, budget, other);
  settings_ = other;
  EXPECT_TRUE(same_pixels(reseeded, render(here_, 2)));
  views.set_scene(load_own_scene("cornell-box"));
  const ViewPicture moved = views.render(here_, 2);
  scene_ = load_own_scene("cornell-box");
  EXPECT_TRUE(same_pixels(moved, render(here_, 2)));
}

// Budgets that end anywhere, and go on: every pixel has each sample once, and each light path has landed once.
TEST_P(LightCacheFrame, InterruptionsDoNotChangeABit) {
  RenderEngine engine(2);
  LoopViews views(engine, scene_, settings_);
  ViewPicture picture;
  for (int k = 0; k < 12; ++k) {
    Budget budget;
    budget.time_s = 1e-4 * (1 << k % 6);
    picture = views.render(here_, budget);
  }
  // Until every pixel has a sample, however slow the machine is.
  float least = 0, most = 0;
  for (double time_s = 0.3; least < 1 && time_s < 200; time_s *= 2) {
    Budget rest;
    rest.samples = 512;
    rest.time_s = time_s;
    picture = views.render(here_, rest);
    least = *std::min_element(picture.samples.begin(), picture.samples.end());
    most = *std::max_element(picture.samples.begin(), picture.samples.end());
  }
  const auto samples = std::uint32_t(most) + 2;
  ASSERT_GE(least, 1);
  EXPECT_TRUE(same_pixels(views.render(here_, samples), render(here_, samples)));
}

// The same view again and again takes work back that is in flight, and the film goes on.
TEST_P(LightCacheFrame, WorkThatIsTakenBackDoesNotChangeABit) {
  RenderEngine engine(2);
  LoopViews views(engine, scene_, settings_);
  constexpr std::uint32_t kSamples = 12;
  views.render(here_, 1);
  for (int k = 0; k < 200; ++k) {
    RenderLoop::Update update;
    update.view = View{std::uint64_t(1000 + k), here_};
    update.budget = Budget{};
    update.budget->samples = kSamples;
    views.loop().update(update);
    std::this_thread::sleep_for(std::chrono::microseconds(137 * (k % 8)));
  }
  EXPECT_TRUE(same_pixels(views.render(here_, kSamples), render(here_, kSamples)));
}

// Light paths are as many as the region's pixels.
TEST_P(LightCacheFrame, ARegionHasItsOwnLightPaths) {
  settings_.region = PixelRect{21, 37, 70, 62};
  const ViewPicture picture = render(here_, 4);
  EXPECT_EQ(picture.end.progress.trace.light_paths, std::uint64_t(settings_.region->area()) * 4);
  EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
}

INSTANTIATE_TEST_SUITE_P(Integrators, LightCacheFrame, testing::ValuesIn(kCaching),
                         [](const auto& info) { return std::string(to_string(info.param)); });

TEST(LightCache, ASceneWithoutLightIsBlackAndEnds) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.5f, 0.5f, 0.5f))};
  add_mesh(scene, box({-1, -1, -1}, {1, 1, 1}, 0, true));
  const auto built = build(std::move(scene));
  RenderEngine engine(2);
  for (const Integrator integrator : kCaching) {
    RenderSettings settings;
    settings.width = settings.height = 40;
    settings.integrator = integrator;
    const ViewPicture picture = LoopViews(engine, built, settings).render(camera_at({0, 0, 0.9}, {0, 0, -1}, 70), 4);
    EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
    for (const float value : picture.radiance[1]) EXPECT_EQ(value, 0);
  }
}

}  // namespace
}  // namespace helio::test
