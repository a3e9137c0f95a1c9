// The integrators with light paths, through the loop and on real scenes: bits, choices and what is told of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/loop_picture.h"
#include "tests/support/own_scenes.h"

namespace helio {
namespace {

class BidirectionalFrame : public ::testing::Test {
 protected:
  test::LoopPicture render(const std::string& scene, Integrator integrator, std::uint32_t samples, int threads = 2) {
    RenderSettings settings;
    settings.width = 100;
    settings.height = 70;
    settings.integrator = integrator;
    Budget budget;
    budget.samples = samples;
    RenderEngine engine(threads);
    return test::render_through_loop(engine, test::load_own_scene(scene), settings, budget);
  }
  static double choose_seconds(const test::LoopPicture& picture) {
    for (const PassTime& pass : picture.end.passes) {
      if (pass.pass == "choose") return pass.seconds;
    }
    return 0;
  }
};

TEST_F(BidirectionalFrame, ThreadsDoNotChangeABit) {
  for (const Integrator integrator : {Integrator::light, Integrator::bdpt, Integrator::pt_bdpt}) {
    const test::LoopPicture one = render("cornell-spheres", integrator, 6, 1);
    const test::LoopPicture four = render("cornell-spheres", integrator, 6, 4);
    for (int c = 0; c < 3; ++c) EXPECT_EQ(one.channels[c], four.channels[c]) << to_string(integrator);
    EXPECT_GT(*std::max_element(one.channels[0].begin(), one.channels[0].end()), 0.1f);
    EXPECT_EQ(one.end.progress.trace.light_paths, one.end.progress.trace.paths);
  }
}

// Light comes to the covered box by way of the ceiling: light paths pay everywhere, and the picture is that of bdpt.
TEST_F(BidirectionalFrame, LightPathsAreChosenWhereTheLightIsHidden) {
  const test::LoopPicture mixed = render("cornell-covered", Integrator::pt_bdpt, 8);
  const test::LoopPicture bdpt = render("cornell-covered", Integrator::bdpt, 8);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(mixed.channels[c], bdpt.channels[c]);
  EXPECT_GT(choose_seconds(mixed), 0);
  EXPECT_EQ(choose_seconds(bdpt), 0);
}

// In the open box next-event estimation does as well in less time: the picture is the path tracer's.
TEST_F(BidirectionalFrame, AndNotWhereItIsSeen) {
  const test::LoopPicture mixed = render("cornell-box", Integrator::pt_bdpt, 8);
  const test::LoopPicture path = render("cornell-box", Integrator::path, 8);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(mixed.channels[c], path.channels[c]);
  EXPECT_EQ(mixed.end.progress.trace.light_paths, 0u);
}

// A point light's light that a mirror throws back is found by light paths alone. The path tracer shows no noise for the
// lack of it.
TEST_F(BidirectionalFrame, LightThatThePathTracerCannotFindIsNotLeftOut) {
  RenderEngine engine(2);
  // Hidden: a black tube around the light lets it out towards the mirror alone, so that the path tracer finds nothing
  // but the glow of the walls.
  struct Case {
    float intensity;
    bool hidden;
    float glow;
  };
  for (const auto& [intensity, hidden, glow] :
       {Case{1, false, 0}, Case{1e9f, false, 0}, Case{1e14f, false, 0}, Case{1e-9f, true, 0}, Case{1, true, 0},
        Case{1e14f, true, 0}, Case{1e9f, true, 1}, Case{1e14f, true, 1e-6f}}) {
    SceneDescription scene;
    Material mirror = test::lambert(Rgb(0.9f, 0.9f, 0.9f));
    mirror.metallic = mirror.specular = 1;
    mirror.roughness = 0;
    scene.materials = {test::lambert(Rgb(0.5f, 0.5f, 0.5f), Rgb(glow, glow, glow)), mirror,
                       test::lambert(Rgb(0, 0, 0))};
    test::add_mesh(scene, test::box({-1, -1, -1}, {1, 1, 1}, 0, true));
    test::add_mesh(scene, test::quad({-0.99f, -0.9f, -0.9f}, {0, 1.8f, 0}, {0, 0, 1.8f}, 1));
    PunctualLight light;
    light.position = V3d(0, 0.3, 0);
    light.intensity = Rgb(intensity, intensity, intensity);
    scene.lights.push_back(light);
    if (hidden) {
      const float r = 0.1f, x0 = -0.3f, x1 = 0.1f, y = 0.3f;
      test::add_mesh(scene, test::quad({x0, y - r, -r}, {x1 - x0, 0, 0}, {0, 2 * r, 0}, 2));
      test::add_mesh(scene, test::quad({x0, y - r, r}, {x1 - x0, 0, 0}, {0, 2 * r, 0}, 2));
      test::add_mesh(scene, test::quad({x0, y - r, -r}, {x1 - x0, 0, 0}, {0, 0, 2 * r}, 2));
      test::add_mesh(scene, test::quad({x0, y + r, -r}, {x1 - x0, 0, 0}, {0, 0, 2 * r}, 2));
      test::add_mesh(scene, test::quad({x1, y - r, -r}, {0, 2 * r, 0}, {0, 0, 2 * r}, 2));
    }
    RenderSettings settings;
    settings.width = settings.height = 64;
    Budget budget;
    budget.samples = 32;
    const auto built = test::build(std::move(scene));
    double means[3];
    for (const Integrator integrator : {Integrator::path, Integrator::bdpt, Integrator::pt_bdpt}) {
      settings.integrator = integrator;
      const test::LoopPicture picture =
          test::render_through_loop(engine, built, settings, budget, test::camera_at({0, 0, 0.9}, {0, 0, -1}, 70));
      double sum = 0;
      for (const float value : picture.channels[1]) sum += value;
      means[integrator == Integrator::path ? 0 : integrator == Integrator::bdpt ? 1 : 2] = sum;
    }
    EXPECT_LT(means[0], (hidden ? 1e-3 : 0.95) * means[1]) << "else the test would not tell";
    EXPECT_NEAR(means[2] / means[1], 1, 0.01) << intensity << (hidden ? ", hidden, " : ", ") << glow;
  }
}

// A region's light paths are those of its own samples: neither those of the blocks that it cuts, nor those of the film.
TEST_F(BidirectionalFrame, ARegionIsAsBrightAsThePathTracerHasIt) {
  RenderSettings settings;
  settings.width = 100;
  settings.height = 70;
  settings.region = PixelRect{21, 37, 70, 62};
  Budget budget;
  budget.samples = 128;
  RenderEngine engine(2);
  const auto scene = test::load_own_scene("cornell-covered");
  double means[2] = {0, 0}, errors[2] = {0, 0};
  for (const int k : {0, 1}) {
    settings.integrator = k == 0 ? Integrator::path : Integrator::bdpt;
    budget.samples = k == 0 ? 1024 : 128;
    const test::LoopPicture picture = test::render_through_loop(engine, scene, settings, budget);
    for (const float value : picture.channels[0]) means[k] += value / double(settings.region->area());
    errors[k] = picture.end.progress.error.rmse / std::sqrt(double(settings.region->area()));
  }
  EXPECT_NEAR(means[1] / means[0], 1, 0.03);
  EXPECT_LT(3 * std::hypot(errors[0], errors[1]) / means[0], 0.03) << "else the test would not tell";
}

// A choice that outlasts its share of the time is given up, and every pixel still gets its samples.
TEST_F(BidirectionalFrame, AShortTimeIsNotSpentOnChoosing) {
  RenderSettings settings;
  settings.width = 1024;
  settings.height = 1024;
  settings.integrator = Integrator::pt_bdpt;
  Budget budget;
  budget.time_s = 1e-3;
  RenderEngine engine(2);
  const test::LoopPicture picture =
      test::render_through_loop(engine, test::load_own_scene("cornell-glossy"), settings, budget);
  EXPECT_EQ(picture.end.reason, FrameEndReason::time);
  EXPECT_EQ(picture.end.progress.trace.light_paths, 0u);
}

TEST_F(BidirectionalFrame, ASceneWithoutLightIsBlackAndEnds) {
  SceneDescription scene;
  scene.materials = {test::lambert(Rgb(0.5f, 0.5f, 0.5f))};
  test::add_mesh(scene, test::box({-1, -1, -1}, {1, 1, 1}, 0, true));
  RenderSettings settings;
  settings.width = settings.height = 40;
  Budget budget;
  budget.samples = 4;
  RenderEngine engine(2);
  const auto built = test::build(std::move(scene));
  for (const Integrator integrator : {Integrator::light, Integrator::bdpt, Integrator::pt_bdpt}) {
    settings.integrator = integrator;
    const test::LoopPicture picture =
        test::render_through_loop(engine, built, settings, budget, test::camera_at({0, 0, 0.9}, {0, 0, -1}, 70));
    EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
    for (const float value : picture.channels[1]) EXPECT_EQ(value, 0);
  }
}

}  // namespace
}  // namespace helio
