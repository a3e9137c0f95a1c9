// Modes that reuse pictures, with the integrators that have light paths.
#include <gtest/gtest.h>

#include <cmath>

#include "renderer/film/core/film.h"
#include "renderer/frame/stages/choose_integrators.h"
#include "renderer/frame/tile_grid.h"
#include "renderer/metrics/error_metrics.h"
#include "renderer/trace/selection/technique_history.h"
#include "tests/support/edited_scenes.h"
#include "tests/support/loop_views.h"
#include "tests/support/own_scenes.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 45, kHeight = 37;

struct Case {
  RenderMode mode;
  Integrator integrator;
};

RenderSettings settings_of(RenderMode mode, Integrator integrator) {
  RenderSettings settings;
  settings.width = kWidth;
  settings.height = kHeight;
  settings.mode = mode;
  settings.integrator = integrator;
  settings.max_segments = 5;
  settings.seed = 5;
  return settings;
}
RenderSettings settings_of(const Case& of) {
  return settings_of(of.mode, of.integrator);
}

double mse(const ViewPicture& a, const ViewPicture& b) {
  return squared_error(a.view(), b.view())->mse;
}

class BidirectionalReuse : public testing::TestWithParam<Case> {
 protected:
  static void SetUpTestSuite() {
    covered_ = load_own_scene("cornell-covered");  // light comes by way of the ceiling
    mixed_ = build(mixed_scene());                 // glass and metal under a lamp: caustics, and much that is glossy
  }
  static void TearDownTestSuite() { covered_ = mixed_ = nullptr; }
  // Seen by the scene's own camera; once for all tests.
  static const ViewPicture& covered_truth() {
    static const ViewPicture picture = [] {
      RenderEngine own(2);
      LoopViews views(own, covered_, settings_of(RenderMode::pt, Integrator::bdpt));
      return views.render(in_covered(), 512);
    }();
    return picture;
  }
  static CameraPose in_covered() { return camera_pose(covered_->description().cameras.at(0)); }
  static CameraPose in_mixed() { return camera_at({0.1, 0.1, 0.9}, {0, -0.2, -1}, 60); }

  static std::shared_ptr<const RenderScene> covered_, mixed_;
  RenderEngine engine{2};
};
std::shared_ptr<const RenderScene> BidirectionalReuse::covered_, BidirectionalReuse::mixed_;

// Notes for later pictures cost no bit.
TEST_P(BidirectionalReuse, TheFirstPictureIsThatOfTheModeWithoutReuse) {
  const RenderMode plain = allocates(GetParam().mode) ? RenderMode::adaptive : RenderMode::pt;
  for (const bool mixed : {false, true}) {
    const auto& scene = mixed ? mixed_ : covered_;
    const CameraPose pose = mixed ? in_mixed() : in_covered();
    LoopViews reusing(engine, scene, settings_of(GetParam()));
    LoopViews other(engine, scene, settings_of(plain, GetParam().integrator));
    const ViewPicture& picture = reusing.render(pose, 24);
    EXPECT_EQ(picture.end.progress.reuse_share, 0);
    const ViewPicture& expected = other.render(pose, 24);
    EXPECT_EQ(picture.radiance[1], expected.radiance[1]);
    EXPECT_EQ(picture.samples, expected.samples);
    if (!mixed) {
      EXPECT_GT(picture.end.progress.trace.light_paths, 0u) << "else nothing is tested here";
    }
  }
}

TEST_P(BidirectionalReuse, ATurnKeepsWhatIsStillTrue) {
  LoopViews views(engine, covered_, settings_of(GetParam()));
  const CameraPose home = in_covered();
  views.render(turned_and_shifted(home, 4, 0), 64);
  const ViewPicture& moved = views.render(home, 2);
  EXPECT_GT(moved.end.progress.reuse_share, 0.9);
  EXPECT_GT(moved.end.progress.trace.light_paths, 0u);
  const ViewPicture& truth = covered_truth();
  LoopViews restarted(engine, covered_, settings_of(RenderMode::pt, GetParam().integrator));
  EXPECT_LT(mse(moved, truth), 0.4 * mse(restarted.render(home, 2), truth));
  // Splats that counted in full beside what is carried would double a part of the light.
  double sum = 0, expected = 0;
  for (std::size_t i = 0; i < truth.samples.size(); ++i) {
    sum += double(moved.radiance[1][i]);
    expected += double(truth.radiance[1][i]);
  }
  EXPECT_NEAR(sum / expected, 1, 0.03);
}

TEST_P(BidirectionalReuse, TheSameViewKeepsItsBits) {
  LoopViews views(engine, mixed_, settings_of(GetParam()));
  views.render(turned_and_shifted(in_mixed(), 3, 0.02), 16);
  const ViewPicture moved = views.render(in_mixed(), 16);
  EXPECT_TRUE(same_pixels(views.render(in_mixed(), 16), moved));
}

TEST_P(BidirectionalReuse, BitsDependNeitherOnThreadsNorOnTiles) {
  std::vector<ViewPicture> pictures;
  for (const auto& [threads, tile] : {std::pair(1, 128), std::pair(2, 128), std::pair(2, 16)}) {
    RenderEngine own(threads);
    RenderLoopOptions options;
    options.tile_size = tile;
    LoopViews views(own, mixed_, settings_of(GetParam()), options);
    for (int step = 3; step > 0; --step) views.render(turned_and_shifted(in_mixed(), 2.0 * step, 0.01 * step), 3);
    pictures.push_back(views.render(in_mixed(), 12));
  }
  EXPECT_GT(pictures[0].end.progress.reuse_share, 0.1);
  EXPECT_TRUE(same_pixels(pictures[0], pictures[1]));
  EXPECT_TRUE(same_pixels(pictures[0], pictures[2]));
}

TEST_P(BidirectionalReuse, AnIdenticalViewIsFoundPixelByPixel) {
  LoopViews views(engine, covered_, settings_of(GetParam()));
  const CameraPose home = in_covered();
  const ViewPicture before = views.render(home, 32);
  views.render(turned_and_shifted(home, 1, 0.01), 4);
  const ViewPicture& back = views.render(home, 1);
  for (std::size_t i = 0; i < before.samples.size(); ++i) {
    EXPECT_GE(back.samples[i], before.samples[i]) << "pixel " << i;
    if (GetParam().mode != RenderMode::combined) {
      EXPECT_LE(back.samples[i], before.samples[i] + 4) << "pixel " << i;
    }
  }
  EXPECT_LE(mean_samples(back), mean_samples(before) + 4);
  LoopViews plain(engine, covered_, settings_of(RenderMode::pt, GetParam().integrator));
  EXPECT_LT(mse(back, before), 0.02 * mse(plain.render(home, 1), before));
}

// Light paths are others than those whose splats were carried: of as many new samples the mean is off the old by half
// the variance; the same once more would change nothing.
TEST_P(BidirectionalReuse, AViewThatIsFoundAgainGetsNewLightPaths) {
  RenderSettings settings = settings_of(GetParam());
  settings.adaptive.measure = ErrorMeasure::rmse;  // what this holds them against
  LoopViews views(engine, covered_, settings);
  const CameraPose home = in_covered();
  views.render(turned_and_shifted(home, 180, 0), 16);
  const ViewPicture first = views.render(home, 16);
  views.render(turned_and_shifted(home, 180, 0), 16);
  const ViewPicture& again = views.render(home, 16);
  EXPECT_GT(again.end.progress.reuse_share, 0.3);
  double variance = 0;
  for (const std::vector<float>& channel : first.variance) {
    for (const float v : channel) variance += double(v) / (3.0 * kWidth * kHeight);
  }
  const double ratio = mse(again, first) / variance;
  EXPECT_GT(ratio, 0.2);
  EXPECT_LT(ratio, 3);
}

TEST_P(BidirectionalReuse, ABudgetThatIsSpentAtOnceLosesNothing) {
  LoopViews views(engine, covered_, settings_of(GetParam()));
  const CameraPose home = in_covered();
  const ViewPicture first = views.render(home, 32);
  Budget none;
  none.time_s = 1e-9;
  for (int step = 1; step <= 3; ++step) views.render(turned_and_shifted(home, 0.1 * step, 0), none);
  const ViewPicture& picture = views.render(home, 2);
  EXPECT_GT(mean_samples(picture), 25);
  LoopViews plain(engine, covered_, settings_of(RenderMode::pt, GetParam().integrator));
  EXPECT_LT(mse(picture, first), 0.1 * mse(plain.render(home, 2), first));
}

// Views that supersede one another at every stage, the copying of the film with its splats among them.
TEST_P(BidirectionalReuse, ViewsInterruptedAnywhereLoseNothing) {
  const CameraPose home = in_covered();
  const ViewPicture& truth = covered_truth();
  RenderLoopOptions options;
  options.publish_passes = true;
  LoopViews views(engine, covered_, settings_of(GetParam()), options);
  views.render(turned_and_shifted(home, 1, 0), 64);
  for (int i = 0; i < 30; ++i) {
    RenderLoop::Update update;
    View view;
    view.id = 1000 + std::uint64_t(i);
    view.camera = turned_and_shifted(home, 1 - i / 30.0, 0);
    update.view = view;
    views.loop().update(update);
    const double until = now_s() + 2e-4 * i;
    while (now_s() < until) {
    }
  }
  const ViewPicture& picture = views.render(home, 2);
  EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
  for (const float n : picture.samples) EXPECT_GE(n, 2);
  EXPECT_GT(mean_samples(picture), 30);
  double sum = 0, expected = 0;
  for (std::size_t i = 0; i < truth.samples.size(); ++i) {
    sum += double(picture.radiance[1][i]);
    expected += double(truth.radiance[1][i]);
  }
  EXPECT_NEAR(sum / expected, 1, 0.03) << "neither without splats nor with those of another picture";
}

TEST_P(BidirectionalReuse, ALensTakesNoPart) {
  CameraPose lens = in_mixed();
  lens.lens_radius = 0.05;
  LoopViews views(engine, mixed_, settings_of(GetParam())), fresh(engine, mixed_, settings_of(GetParam()));
  views.render(lens, 8);
  const CameraPose moved = turned_and_shifted(lens, 1, 0);
  const ViewPicture& picture = views.render(moved, 8);
  EXPECT_EQ(picture.end.progress.reuse_share, 0);
  LoopViews plain(engine, mixed_, settings_of(RenderMode::pt, GetParam().integrator));
  const ViewPicture& expected = plain.render(moved, 8);
  double sum = 0, whole = 0;
  for (std::size_t i = 0; i < expected.samples.size(); ++i) {
    sum += double(picture.radiance[1][i]);
    whole += double(expected.radiance[1][i]);
  }
  EXPECT_NEAR(sum / whole, 1, 0.15) << "no splats of the view before";
}

// Splats are of their own picture alone: a camera that has left the room sees black.
TEST_P(BidirectionalReuse, NoSplatStaysWhereTheCameraLooksElsewhere) {
  LoopViews views(engine, covered_, settings_of(GetParam()));
  CameraPose away = in_covered();
  views.render(away, 8);
  away.position -= V3d(away.forward) * 1000.0;
  away = turned_and_shifted(away, 180, 0);
  const ViewPicture& picture = views.render(away, 4);
  for (const std::vector<float>& channel : picture.radiance) {
    for (const float value : channel) EXPECT_EQ(value, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, BidirectionalReuse,
                         testing::Values(Case{RenderMode::reproject, Integrator::bdpt},
                                         Case{RenderMode::combined, Integrator::bdpt},
                                         Case{RenderMode::reproject, Integrator::pt_bdpt},
                                         Case{RenderMode::combined, Integrator::pt_bdpt}),
                         [](const auto& test) {
                           return std::string(to_string(test.param.mode)) +
                                  (test.param.integrator == Integrator::bdpt ? "_bdpt" : "_pt_bdpt");
                         });

// What an edit changes is measured with the path tracer, on films without splats.
TEST(BidirectionalReuseEdit, KeepsWhatAnEditLeavesTrue) {
  RenderEngine engine(2);
  const auto before = build(yard());
  ASSERT_TRUE(before);
  const auto after = edited(before, {moved_by(1, {0.5, 0, 0})});
  ASSERT_TRUE(after);
  LoopViews views(engine, before, settings_of(RenderMode::reproject, Integrator::bdpt));
  views.render(yard_camera(), 64);
  views.set_scene(after);
  const ViewPicture picture = views.render(yard_camera(), 8);
  EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
  EXPECT_GT(picture.end.progress.reuse_share, 0.3);
  LoopViews fresh(engine, after, settings_of(RenderMode::pt, Integrator::path));
  const ViewPicture truth = fresh.render(yard_camera(), 256);
  LoopViews restarted(engine, after, settings_of(RenderMode::pt, Integrator::bdpt));
  EXPECT_LT(mse(picture, truth), 0.7 * mse(restarted.render(yard_camera(), 8), truth));
}

// A quarter of the light paths makes a choice, which stands where time ends while more are traced.
TEST(BidirectionalReuseChoice, WhatIsChosenCountsBeforeAllIsProbed) {
  const auto scene = load_own_scene("cornell-covered");
  FilmState state;
  state.splats = true;
  Film film(256, 192, state);
  TechniqueHistory history;
  ChooseIntegrators choice(scene, camera_pose(scene->description().cameras.at(0)), {}, std::make_shared<CancelToken>(),
                           film, &history);
  TraceStats stats;
  TileGrid grid(film.bounds(), 64);
  for (int sweep = 0; sweep + 1 < choice.sweeps(); ++sweep) {
    EXPECT_FALSE(film.light_tiles()) << sweep;
    for (std::size_t part = 0; part < choice.parts(); ++part) choice.run(sweep, part, stats);
    choice.finish_sweep(sweep);
  }
  ASSERT_TRUE(film.light_tiles());
  EXPECT_TRUE(film.light_tiles()->any());
  EXPECT_TRUE(history.views(scene, 256, 192).empty());
  for (std::size_t part = 0; part < choice.parts(); ++part) choice.run(choice.sweeps() - 1, part, stats);
  choice.finish_sweep(choice.sweeps() - 1);
  choice.finished(grid);
  EXPECT_EQ(history.views(scene, 256, 192).size(), 1u);
}

// By what the loop keeps: each view that was probed adds to it. Without reuse every view chooses anew.
TEST(BidirectionalReuseChoice, WhatEarlierViewsChoseIsNotProbedAgain) {
  RenderEngine engine(2);
  const auto scene = load_own_scene("cornell-covered");
  const CameraPose home = camera_pose(scene->description().cameras.at(0));
  std::size_t grid = 0;  // what every loop keeps beside its film once it has a view
  for (const RenderMode mode : {RenderMode::pt, RenderMode::reproject}) {
    RenderSettings settings = settings_of(mode, Integrator::pt_bdpt);
    settings.width = settings.height = 256;
    LoopViews views(engine, scene, settings);
    const auto bytes_after = [&](const CameraPose& pose) {
      EXPECT_GT(views.render(pose, 1).end.progress.trace.light_paths, 0u);
      return views.loop().memory_bytes();
    };
    const std::size_t nothing = views.loop().memory_bytes();
    const std::size_t first = bytes_after(turned_and_shifted(home, 12, 0)) - nothing;
    const std::size_t step = bytes_after(turned_and_shifted(home, 11.8, 0)) - nothing;
    const std::size_t turn = bytes_after(home) - nothing;
    if (mode == RenderMode::pt) {
      EXPECT_EQ(step, first);
      EXPECT_EQ(turn, first);
      grid = first;
      continue;
    }
    EXPECT_GE(first, grid + 64 * sizeof(TileEstimate));
    EXPECT_EQ(step, first) << "nothing has come into view";
    EXPECT_GT(turn, step);
    settings.seed = 9;
    Budget one;
    one.samples = 1;
    views.render(home, one, settings);
    EXPECT_EQ(views.loop().memory_bytes() - nothing, first) << "other settings, another choice";
  }
}

// A scene whose light is put out gets no light paths, and the splats of the picture before neither stay nor come back.
TEST(BidirectionalReuseEdit, LightThatGoesOutLeavesNoSplats) {
  RenderEngine engine(2);
  const auto lit = load_own_scene("cornell-covered");
  std::uint32_t lamp = 0;
  while (is_black(lit->description().materials.at(lamp).emission)) ++lamp;
  const auto dark = edited(lit, {shining(lamp, Rgb(0, 0, 0))});
  const CameraPose home = camera_pose(lit->description().cameras.at(0));
  LoopViews fresh(engine, lit, settings_of(RenderMode::pt, Integrator::bdpt));
  const double truth = mean_radiance(fresh.render(home, 256));
  LoopViews views(engine, lit, settings_of(RenderMode::reproject, Integrator::pt_bdpt));
  ASSERT_GT(views.render(home, 64).end.progress.trace.light_paths, 0u);
  views.set_scene(dark);
  EXPECT_EQ(mean_radiance(views.render(home, 2)), 0);
  views.set_scene(lit);
  EXPECT_NEAR(mean_radiance(views.render(home, 64)) / truth, 1, 0.1);
  EXPECT_NEAR(mean_radiance(views.render(turned_and_shifted(home, 0.2, 0), 64)) / truth, 1, 0.1);
}

// Tiles are not shown alone, nor while light paths are still under way, also where a view begins with what is carried.
TEST(BidirectionalReuseBudget, TheFirstSampleIsShownWhole) {
  RenderEngine engine(2);
  const auto room = build(lambert_room());
  const CameraPose home = camera_at({0.1, 0.1, 0.9}, {0, -0.2, -1}, 60);
  RenderLoopOptions options;
  options.publish_passes = true;
  std::vector<ViewPicture> pictures;
  for (int run = 0; run < 2; ++run) {
    LoopViews views(engine, room, settings_of(RenderMode::reproject, Integrator::bdpt), options);
    views.render(turned_and_shifted(home, 2, 0), 16);
    pictures.push_back(views.render(home, 1));
  }
  EXPECT_TRUE(same_pixels(pictures[0], pictures[1]));
}

}  // namespace
}  // namespace helio::test
