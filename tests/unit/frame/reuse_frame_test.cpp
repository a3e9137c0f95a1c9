// Modes that reuse pictures, through the render loop.
#include <gtest/gtest.h>

#include <algorithm>

#include "recording_sink.h"
#include "renderer/film/core/film.h"
#include "renderer/metrics/error_metrics.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 61, kHeight = 45;

RenderSettings settings_of(RenderMode mode) {
  return loop_settings(kWidth, kHeight, mode);
}

CameraPose home() {
  return camera_at({0.1, 0.1, 0.9}, {0, -0.2, -1}, 60);
}

double mse(const ViewPicture& a, const ViewPicture& b) {
  return squared_error(a.view(), b.view())->mse;
}

const auto kReusing = testing::Values(RenderMode::reproject, RenderMode::combined);

class ReuseFrame : public testing::TestWithParam<RenderMode> {
 protected:
  RenderEngine engine{2};
  std::shared_ptr<const RenderScene> room = build(lambert_room()), mixed = build(mixed_scene());
};

TEST_P(ReuseFrame, TheFirstPictureIsThatOfTheModeWithoutReuse) {
  const RenderMode plain = allocates(GetParam()) ? RenderMode::adaptive : RenderMode::pt;
  for (const auto& scene : {room, mixed}) {
    LoopViews reusing(engine, scene, settings_of(GetParam())), other(engine, scene, settings_of(plain));
    const ViewPicture& picture = reusing.render(home(), 32);
    EXPECT_EQ(picture.end.progress.reuse_share, 0);
    const ViewPicture expected = other.render(home(), 32);
    EXPECT_EQ(picture.radiance[1], expected.radiance[1]);
    EXPECT_EQ(picture.samples, expected.samples);
  }
}

TEST_P(ReuseFrame, ATurnKeepsWhatIsStillTrue) {
  LoopViews views(engine, room, settings_of(GetParam())), fresh(engine, room, settings_of(RenderMode::pt));
  views.render(turned_and_shifted(home(), 4, 0), 256);
  const ViewPicture& moved = views.render(home(), 2);
  EXPECT_GT(moved.end.progress.reuse_share, 0.9);
  // Through pixels, through those beside the picture, some of which two threads look at, and through rims.
  const double pixels = kWidth * kHeight, beside = 2 * (kWidth + kHeight) + 4;
  EXPECT_GE(moved.end.progress.verification_rays, pixels + beside);
  EXPECT_LE(moved.end.progress.verification_rays, 2 * pixels + 1.1 * beside);
  const ViewPicture truth = fresh.render(home(), 4096);
  LoopViews restarted(engine, room, settings_of(RenderMode::pt));
  const double without = mse(restarted.render(home(), 2), truth);
  EXPECT_LT(mse(moved, truth), 0.25 * without);  // edges and what has come into view are as noisy as ever
}

TEST_P(ReuseFrame, TheSameViewKeepsItsBits) {
  LoopViews views(engine, mixed, settings_of(GetParam()));
  views.render(turned_and_shifted(home(), 3, 0.02), 16);
  const ViewPicture moved = views.render(home(), 16);
  EXPECT_TRUE(same_pixels(views.render(home(), 16), moved));
}

// Time was over before the first fresh sample: what was carried is a picture all the same, for who comes later.
TEST_P(ReuseFrame, ACarriedPictureWithoutSamplesIsShownAgain) {
  const auto sink = std::make_shared<RecordingSink>();
  RenderLoop loop(engine, room, settings_of(GetParam()), {}, RenderRank::interactive, sink);
  RenderLoop::Update update;
  update.view = View{1, turned_and_shifted(home(), 1, 0)};
  update.budget = Budget{};
  update.budget->samples = 16;
  ASSERT_TRUE(sink->wait_for_end(loop.update(update)));
  update.view = View{2, home()};
  update.budget = Budget{};
  update.budget->time_s = 1e-9;
  const auto end = sink->wait_for_end(loop.update(update));
  ASSERT_TRUE(end);
  EXPECT_EQ(end->progress.samples_per_pixel, 0u);
  EXPECT_EQ(end->progress.reuse_share, 1);
  loop.republish();
  ASSERT_TRUE(sink->wait([&] { return sink->ends.size() == 3; }));
  EXPECT_EQ(sink->ends[2].tag.view_id, 2u);
  EXPECT_EQ(sink->tiles.back().tag.frame, sink->ends[2].tag.frame);
  EXPECT_TRUE(sink->tiles.back().final);
}

TEST_P(ReuseFrame, BitsDependNeitherOnThreadsNorOnTiles) {
  std::vector<ViewPicture> pictures;
  for (const auto& [threads, tile] : {std::pair(1, 128), std::pair(2, 128), std::pair(2, 16)}) {
    RenderEngine own(threads);
    RenderLoopOptions options;
    options.tile_size = tile;
    LoopViews views(own, mixed, settings_of(GetParam()), options);
    for (int step = 4; step > 0; --step) views.render(turned_and_shifted(home(), 2.0 * step, 0.01 * step), 3);
    pictures.push_back(views.render(home(), 20));
  }
  EXPECT_GT(pictures[0].end.progress.reuse_share, 0.1);
  EXPECT_TRUE(same_pixels(pictures[0], pictures[1]));
  EXPECT_TRUE(same_pixels(pictures[0], pictures[2]));
}

TEST_P(ReuseFrame, SingleSamplesAddUpWhileTheCameraMoves) {
  LoopViews views(engine, room, settings_of(GetParam()));
  for (int step = 40; step > 0; --step) views.render(turned_and_shifted(home(), 0.01 * step, 0), 1);
  const ViewPicture& picture = views.render(home(), 1);
  // Where counts may differ they go to edges, which carry nothing, rather than to what is rich already.
  EXPECT_GT(mean_samples(picture), GetParam() == RenderMode::combined ? 5 : 20);
  LoopViews once(engine, room, settings_of(RenderMode::pt)), fresh(engine, room, settings_of(RenderMode::pt));
  const ViewPicture truth = fresh.render(home(), 4096);
  EXPECT_LT(mse(picture, truth), 0.25 * mse(once.render(home(), 1), truth));
}

TEST_P(ReuseFrame, AJumpCarriesNothing) {
  constexpr auto kPixels = std::uint64_t(kWidth * kHeight);
  LoopViews views(engine, room, settings_of(GetParam()));
  EXPECT_GE(views.render(home(), 16).end.progress.verification_rays, kPixels) << "the camera may move soon";
  const CameraPose away = turned_and_shifted(home(), 180, 0);
  const ViewPicture& behind = views.render(away, 16);
  EXPECT_EQ(behind.end.progress.reuse_share, 0);
  EXPECT_EQ(behind.end.progress.samples_per_pixel, 16u);
  EXPECT_GE(behind.end.progress.verification_rays, kPixels);
}

TEST_P(ReuseFrame, APictureThatBeganFromNothingIsKeptWhereverItIsLeft) {
  for (const std::uint32_t samples : {4u, 16u, 32u}) {
    LoopViews views(engine, room, settings_of(GetParam()));
    views.render(turned_and_shifted(home(), 1, 0), samples);
    const ViewPicture& moved = views.render(home(), 1);
    EXPECT_GT(moved.end.progress.reuse_share, 0.7 * samples / (samples + 1)) << samples;
  }
}

TEST_P(ReuseFrame, ALookAsideAndBackFindsThePictureAgain) {
  LoopViews views(engine, room, settings_of(GetParam()));
  views.render(home(), 256);
  views.render(turned_and_shifted(home(), 180, 0), 64);
  const ViewPicture& back = views.render(home(), 2);
  EXPECT_GT(mean_samples(back), 200);
}

TEST_P(ReuseFrame, AnIdenticalViewIsFoundPixelByPixel) {
  LoopViews views(engine, mixed, settings_of(GetParam()));
  const ViewPicture before = views.render(home(), 64);
  views.render(turned_and_shifted(home(), 1, 0.01), 4);
  const ViewPicture& back = views.render(home(), 1);
  for (std::size_t i = 0; i < before.samples.size(); ++i) {
    // At edges as elsewhere.
    EXPECT_GE(back.samples[i], before.samples[i]) << "pixel " << i;
    if (GetParam() != RenderMode::combined) {
      EXPECT_LE(back.samples[i], before.samples[i] + 4) << "pixel " << i;
    }
  }
  EXPECT_LE(mean_samples(back), mean_samples(before) + 4);
  // One sample more than 64, of some pixels several, is a small change.
  LoopViews plain(engine, mixed, settings_of(RenderMode::pt));
  EXPECT_LT(mse(back, before),
            (GetParam() == RenderMode::combined ? 0.005 : 0.002) * mse(plain.render(home(), 1), before));
}

TEST_P(ReuseFrame, AViewThatIsFoundAgainGetsNewSamples) {
  // Once more the samples that were carried would change nothing, and halve the reported variance. Of as many new ones,
  // the mean of old and new is off the old by half the variance.
  LoopViews views(engine, room, settings_of(GetParam()));
  views.render(turned_and_shifted(home(), 180, 0), 64);
  const ViewPicture first = views.render(home(), 64);
  views.render(turned_and_shifted(home(), 180, 0), 64);
  const ViewPicture& again = views.render(home(), 64);
  EXPECT_GT(again.end.progress.reuse_share, 0.3);
  double variance = 0;
  for (const std::vector<float>& channel : first.variance) {
    for (const float v : channel) variance += double(v) / (3.0 * kWidth * kHeight);
  }
  const double ratio = mse(again, first) / variance;
  std::printf("off by %.2f of the variance\n", ratio);
  EXPECT_GT(ratio, 0.25);
  EXPECT_LT(ratio, 3);
}

TEST_P(ReuseFrame, PixelsOutsideTheRegionAreNotDrawnOn) {
  // Sources are full of a picture of the whole film; then other settings and a region, and a view that would look up
  // what lies beyond it.
  LoopViews views(engine, mixed, settings_of(GetParam()));
  views.render(home(), 64);
  views.render(turned_and_shifted(home(), 2, 0), 64);
  views.render(home(), 64);  // now both hold one, and the next to be overwritten is this view's
  RenderSettings part = settings_of(GetParam());
  part.max_segments = 1;
  part.region = PixelRect{20, 10, 40, 30};
  Budget budget;
  budget.samples = 16;
  views.render(home(), budget, part);
  const ViewPicture moved = views.render(turned_and_shifted(home(), 8, 0), budget);
  LoopViews fresh(engine, mixed, part);
  const ViewPicture& expected = fresh.render(turned_and_shifted(home(), 8, 0), budget);
  double off = 0, squared = 0;
  for (int y = part.region->y0; y < part.region->y1; ++y) {
    for (int x = part.region->x0; x < part.region->x1; ++x) {
      const std::size_t i = std::size_t(y) * kWidth + std::size_t(x);
      off += std::abs(double(moved.radiance[1][i]) - double(expected.radiance[1][i]));
      squared += double(expected.radiance[1][i]);
    }
  }
  EXPECT_LE(off, 0.1 * squared);  // emission alone: black here, or noisy at its edges
}

TEST_P(ReuseFrame, ABudgetThatIsSpentAtOnceLosesNothing) {
  LoopViews views(engine, room, settings_of(GetParam()));
  views.render(home(), 256);
  Budget none;
  none.time_s = 1e-9;
  for (int step = 1; step <= 3; ++step) views.render(turned_and_shifted(home(), 0.1 * step, 0), none);
  const ViewPicture& picture = views.render(home(), 2);
  EXPECT_GT(mean_samples(picture), 200);
}

TEST_P(ReuseFrame, SettingsAndRegionsBeginAnew) {
  LoopViews views(engine, room, settings_of(GetParam()));
  const ViewPicture first = views.render(home(), 32);
  RenderSettings deeper = settings_of(GetParam());
  deeper.max_segments = 3;
  Budget budget;
  budget.samples = 32;
  EXPECT_EQ(views.render(turned_and_shifted(home(), 1, 0), budget, deeper).end.progress.reuse_share, 0);
  EXPECT_TRUE(same_pixels(views.render(home(), budget, settings_of(GetParam())), first));
  RenderSettings part = settings_of(GetParam());
  part.region = PixelRect{5, 3, 40, 30};
  EXPECT_EQ(views.render(turned_and_shifted(home(), 1, 0), budget, part).end.progress.reuse_share, 0);
  EXPECT_GT(views.render(home(), budget).end.progress.reuse_share, 0.1);
}

TEST_P(ReuseFrame, ALensTakesNoPart) {
  CameraPose lens = home();
  lens.lens_radius = 0.05;
  LoopViews views(engine, room, settings_of(GetParam()));
  views.render(lens, 16);
  EXPECT_EQ(views.render(turned_and_shifted(lens, 1, 0), 16).end.progress.reuse_share, 0);
}

TEST_P(ReuseFrame, ViewsInterruptedAnywhereLoseNothing) {
  // Views that supersede one another before they are done, at every stage; then one that may finish. What was there
  // before them is carried to it, and no pixel is left without samples.
  LoopViews views(engine, room, settings_of(GetParam()));
  views.render(home(), 256);
  for (int i = 0; i < 60; ++i) {
    RenderLoop::Update update;
    View view;
    view.id = 1000 + std::uint64_t(i);
    view.camera = turned_and_shifted(home(), 0.05 * (i + 1), 0);
    update.view = view;
    views.loop().update(update);
    const double until = now_s() + 1e-4 * i;
    while (now_s() < until) {
    }
  }
  const ViewPicture& picture = views.render(turned_and_shifted(home(), 2, 0), 2);
  EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
  double samples = 0;
  for (const float n : picture.samples) {
    EXPECT_GE(n, 2);
    samples += n;
  }
  EXPECT_GT(samples / double(picture.samples.size()), 100);
}

// Whatever interrupts the reprojection of a picture and keeps its view, no pixel is left without its samples: after a
// picture that can be a source, and after one that cannot.
TEST_P(ReuseFrame, BudgetsThatInterruptTheFirstTilesLoseNothing) {
  CameraPose lens = home();
  lens.lens_radius = 0.05;
  for (const CameraPose& before : {turned_and_shifted(home(), 1, 0), lens}) {
    for (int i = 0; i < 40; ++i) {
      RenderLoopOptions options;
      options.publish_passes = true;
      LoopViews views(engine, room, settings_of(GetParam()), options);
      views.render(before, 4);
      RenderLoop::Update update;
      update.view = View{1000, home()};
      update.view->camera.aspect = 0;
      for (std::uint32_t samples : {64u, 63u, 62u}) {
        update.budget.emplace().samples = samples;
        views.loop().update(update);
        const double until = now_s() + 1e-4 * i;
        while (now_s() < until) {
        }
      }
      const ViewPicture& picture = views.render(home(), 16);
      EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
      for (const float n : picture.samples) ASSERT_GE(n, 1) << i;
      if (GetParam() != RenderMode::reproject) continue;
      for (const float n : picture.samples) ASSERT_GE(n, 16) << i << ": every pixel gets as many";
    }
  }
}

TEST_P(ReuseFrame, ViewsInterruptedByTheNextLeaveTheAnchor) {
  // Each is left before it has more than its first sample; the picture that they all draw on is that of 256.
  RenderLoopOptions options;
  options.publish_passes = true;
  LoopViews views(engine, room, settings_of(GetParam()), options);
  views.render(home(), 256);
  for (int i = 0; i < 40; ++i) {
    RenderLoop::Update update;
    View view;
    view.id = 1000 + std::uint64_t(i);
    view.camera = turned_and_shifted(home(), 90 + i, 0);
    update.view = view;
    update.budget.emplace();
    update.budget->samples = 64;
    views.loop().update(update);
    const double until = now_s() + 1.5e-4 * i;
    while (now_s() < until) {
    }
  }
  EXPECT_GT(mean_samples(views.render(home(), 2)), 250);
}

TEST(CombinedFrame, OtherPixelsAreLookedAtInEveryPicture) {
  RenderEngine engine(2);
  RenderLoopOptions options;
  options.channels |= kResolveDensity;
  LoopViews views(engine, build(lambert_room()), settings_of(RenderMode::combined), options);
  views.render(home(), 1024);
  std::vector<int> looked_at(std::size_t(kWidth) * kHeight);
  for (int step = 1; step <= 8; ++step) {
    const ViewPicture& picture = views.render(turned_and_shifted(home(), 0.001 * step, 0), 1);
    double density = 0;
    for (std::size_t i = 0; i < looked_at.size(); ++i) {
      looked_at[i] += picture.density[i] > 0;
      density += double(picture.density[i]) / double(looked_at.size());
    }
    EXPECT_NEAR(density, 1, 0.02);
  }
  const auto never = std::count(looked_at.begin(), looked_at.end(), 0),
             always = std::count(looked_at.begin(), looked_at.end(), 8);
  // An eighth in each of them, and edges: 0.34 of the others in none.
  EXPECT_LT(double(never), 0.45 * double(looked_at.size()));
  EXPECT_LT(double(always), 0.5 * double(looked_at.size()));
}

INSTANTIATE_TEST_SUITE_P(Modes, ReuseFrame, kReusing, [](const auto& test) { return to_string(test.param); });

TEST(ReuseBudget, ThatInterruptsTheFirstSamplesCountsNothingTwice) {
  // The camera comes back, and finds 64 samples a pixel; on the way another budget arrives, at any stage.
  RenderEngine engine(2);
  const auto room = build(lambert_room());
  RenderLoopOptions options;
  options.publish_passes = true;  // the first sample comes in one plan with what is carried
  for (int i = 0; i < 48; ++i) {
    LoopViews views(engine, room, settings_of(RenderMode::reproject), options);
    views.render(home(), 64);
    views.render(turned_and_shifted(home(), 5, 0), 2);
    RenderLoop::Update back;
    View view;
    view.id = 1000;
    view.camera = home();
    back.view = view;
    back.budget.emplace();
    back.budget->samples = 1;
    views.loop().update(back);
    const double until = now_s() + 1e-4 * i;
    while (now_s() < until) {
    }
    const ViewPicture& picture = views.render(home(), 16);
    // But for a few that the review has taken something back from.
    const auto whole = std::count(picture.samples.begin(), picture.samples.end(), 80.0f);
    EXPECT_GT(double(whole), 0.98 * double(picture.samples.size())) << i;
    EXPECT_LE(*std::max_element(picture.samples.begin(), picture.samples.end()), 80) << i;
    EXPECT_EQ(picture.end.progress.samples_per_pixel, 16u);
  }
}

TEST(ReuseMemory, IsAsDocumented) {
  const auto bytes = [](const FilmState& state) { return Film::bytes_per_pixel(state); };
  EXPECT_EQ(bytes({}), 120u);
  EXPECT_EQ(bytes({.targets = true}), 126u);
  EXPECT_EQ(bytes({.history = true}), 120u + 194u);
  EXPECT_EQ(bytes({.targets = true, .history = true}), 320u);
  EXPECT_EQ(bytes({.targets = true, .exact_counts = true}), 128u);
  EXPECT_EQ(bytes({.history = true, .carried_only = true}), 120u + 30u);
}

}  // namespace
}  // namespace helio::test
