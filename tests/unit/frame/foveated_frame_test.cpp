// Pictures whose samples follow a gaze.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

#include "recording_sink.h"
#include "renderer/frame/stages/allocate.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 96, kHeight = 64;
const CameraPose kHome = camera_at({0, 0, 0.95}, {0, -0.2, -1}, 70);

RenderSettings foveated(RenderMode mode, Foveation kind = Foveation::density) {
  RenderSettings settings = loop_settings(kWidth, kHeight, mode);
  settings.foveation.kind = kind;
  settings.foveation.viewing_distance = 1.5;
  return settings;
}

// Of 16 x 16 pixels around a point.
double samples_at(const ViewPicture& picture, int x, int y) {
  double sum = 0;
  int count = 0;
  for (int py = std::max(y - 8, 0); py < std::min(y + 8, kHeight); ++py) {
    for (int px = std::max(x - 8, 0); px < std::min(x + 8, kWidth); ++px, ++count)
      sum += picture.samples[std::size_t(py) * kWidth + std::size_t(px)];
  }
  return sum / count;
}

class FoveatedFrame : public testing::TestWithParam<RenderMode> {
 protected:
  RenderEngine engine_{2};
  std::shared_ptr<const RenderScene> scene_ = build(lambert_room());
};

// Budgets of samples are those of the pixels that somebody looks at.
TEST_P(FoveatedFrame, SamplesGoWhereSomebodyLooks) {
  LoopViews views(engine_, scene_, foveated(GetParam()));
  views.gaze = Gaze{20, 32};
  const ViewPicture& picture = views.render(kHome, 128);
  EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
  if (!allocates(GetParam())) {
    EXPECT_NEAR(samples_at(picture, 20, 32), 128, 40);
  }
  EXPECT_GT(samples_at(picture, 20, 32), 4 * samples_at(picture, 88, 32));
  EXPECT_LT(mean_samples(picture), 0.6 * 128);
  EXPECT_EQ(picture.end.progress.samples_per_pixel, std::uint32_t(mean_samples(picture) + 0.5));
  for (const float count : picture.samples) ASSERT_GE(count, 2);
}

// What the film has stays where the gaze was, and an end is none for a gaze that moves.
TEST_P(FoveatedFrame, AGazeThatMovesTakesSamplesAlong) {
  LoopViews views(engine_, scene_, foveated(GetParam()));
  views.gaze = Gaze{16, 32};
  const ViewPicture before = views.render(kHome, 64);
  const ViewPicture& after = views.move_gaze(Gaze{80, 32});
  EXPECT_EQ(after.end.tag.revision, before.end.tag.revision);
  EXPECT_GT(after.end.tag.frame, before.end.tag.frame);
  EXPECT_GE(samples_at(after, 80, 32), 0.7 * samples_at(before, 16, 32));
  for (std::size_t i = 0; i < before.samples.size(); ++i) ASSERT_GE(after.samples[i], before.samples[i]);
  // Back again, nothing is left to be done there.
  const double had = samples_at(after, 16, 32);
  const ViewPicture& again = views.move_gaze(Gaze{16, 32});
  EXPECT_NEAR(samples_at(again, 16, 32), had, 0.5 * had);
  EXPECT_EQ(again.end.reason, FrameEndReason::samples);
}

// A picture that draws on the one before gets its fresh samples where somebody looks, too.
TEST_P(FoveatedFrame, HistoryFillsUpWhereSomebodyLooks) {
  const CameraPose moved = camera_at({0.02, 0, 0.95}, {0.02, -0.2, -1}, 70);
  double left[2], right[2];
  for (const int there : {0, 1}) {
    LoopViews views(engine_, scene_, foveated(GetParam()));
    views.gaze = Gaze{48, 32};
    views.render(kHome, 64);
    views.gaze = there == 0 ? Gaze{12, 32} : Gaze{84, 32};
    const ViewPicture& picture = views.render(moved, 64);
    left[there] = samples_at(picture, 12, 32);
    right[there] = samples_at(picture, 84, 32);
  }
  EXPECT_GT(left[0], 3 * left[1]);
  EXPECT_GT(right[1], 3 * right[0]);
}

TEST_P(FoveatedFrame, WithoutAGazeThePictureIsThatWithoutFoveation) {
  LoopViews plain(engine_, scene_, foveated(GetParam(), Foveation::none)), views(engine_, scene_, foveated(GetParam()));
  const ViewPicture expected = plain.render(kHome, 64);
  const ViewPicture& picture = views.render(kHome, 64);
  if (!reuses(GetParam())) {
    EXPECT_TRUE(same_pixels(picture, expected));
  }
  EXPECT_NEAR(mean_samples(picture), mean_samples(expected), 1);
}

TEST_P(FoveatedFrame, GazesOfAllKinds) {
  for (const Gaze gaze : {Gaze{-1000, 32}, Gaze{kMostGazePixels, -kMostGazePixels}, Gaze{0, 0}, Gaze{95.5, 63.9}}) {
    LoopViews views(engine_, scene_, foveated(GetParam()));
    views.gaze = gaze;
    const ViewPicture& picture = views.render(kHome, 32);
    EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
    for (const float count : picture.samples) ASSERT_GE(count, 2);
  }
}

// A move a millisecond while it renders: it comes to its end, and no pixel has more than was asked for.
TEST_P(FoveatedFrame, AGazeThatJumpsIsFollowedToTheEnd) {
  LoopViews views(engine_, scene_, foveated(GetParam()));
  views.gaze = Gaze{48, 32};
  views.render(kHome, 64);
  std::uint32_t random = 1;
  for (int k = 0; k < 200; ++k) {
    random = random * 1664525 + 1013904223;
    views.loop().move_gaze(Gaze{double(random >> 16 & 127), double(random >> 24 & 63)});
    if (k % 8 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const ViewPicture& picture = views.settle();
  EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
  if (GetParam() == RenderMode::pt) {
    for (const float count : picture.samples) ASSERT_LE(count, 64);
  }
}

INSTANTIATE_TEST_SUITE_P(All, FoveatedFrame,
                         testing::Values(RenderMode::pt, RenderMode::adaptive, RenderMode::reproject,
                                         RenderMode::combined),
                         [](const auto& info) { return std::string(to_string(info.param)); });

// Of a film of 100 pixels, of which a quarter is looked at.
FrameState looked_at() {
  FrameState state;
  state.begun_s = 1;
  state.done[0] = state.done[1] = 1;
  state.round.pixels = 100;
  state.round.samples = 200;
  state.density_share = 0.25;
  state.gaze_moves = 1;
  state.published = true;
  state.published_samples = 2;
  return state;
}

FrameScheduler scheduler(std::uint32_t samples) {
  Budget budget;
  budget.samples = samples;
  AllocationSettings allocation;
  allocation.by_noise = false;
  allocation.min_samples = 2;
  return FrameScheduler(budget, {}, allocation);
}

TEST(FoveatedScheduler, AMoveOfTheGazeBeginsTheNextRound) {
  FrameState state = looked_at();
  state.round.number = 1;
  state.round.mean = 8;
  state.round.gaze_moves = 1;
  state.round.summary.top[0] = state.round.summary.top[1] = 32;  // of which one is done
  state.round.published = 200;
  const FramePlan goes_on = scheduler(1024).plan_next(state, 1, 0, 2);
  ASSERT_TRUE(goes_on.round);
  EXPECT_TRUE(goes_on.before.empty());
  ++state.gaze_moves;
  const FramePlan anew = scheduler(1024).plan_next(state, 1, 0, 2);
  ASSERT_EQ(anew.before.size(), 1u);
  EXPECT_EQ(anew.before[0].id, StageId::allocate);
  EXPECT_EQ(anew.before[0].allocation.mean, 2) << "twice what there is, not what was asked for elsewhere";
}

TEST(FoveatedScheduler, TheBudgetIsThatOfThePixelsAtTheGaze) {
  FrameState state = looked_at();
  state.round.number = 3;
  state.round.gaze_moves = 1;
  state.round.mean = 8;  // per half: 16 of 64 times a quarter
  state.round.samples = 1600;
  state.round.published = 1600;
  state.done[0] = state.done[1] = 32;
  EXPECT_EQ(scheduler(64).plan_next(state, 1, 0, 2).end, FrameEndReason::samples);
  EXPECT_EQ(scheduler(128).plan_next(state, 1, 0, 2).end, std::nullopt);
  ++state.gaze_moves;
  EXPECT_EQ(scheduler(64).plan_next(state, 1, 0, 2).end, std::nullopt) << "the gaze has moved";
  EXPECT_NEAR(scheduler(64).budget_used(state, 2), 1, 1e-12);
}

TEST(FoveatedSettings, WhatDoesNotGoTogetherIsRefused) {
  const auto problems_of = [](const RenderSettings& settings) {
    Problems problems;
    validate(settings, {}, "settings", problems);
    return problems.empty() ? std::string() : problems.to_error().to_string();
  };
  EXPECT_EQ(problems_of(foveated(RenderMode::pt)), "");
  RenderSettings bad = foveated(RenderMode::pt);
  bad.integrator = Integrator::lvc;
  EXPECT_NE(problems_of(bad).find("settings.foveation: density with integrator lvc; allowed: with path"),
            std::string::npos);
  bad = foveated(RenderMode::adaptive);
  bad.variant = ModeVariant::paper;
  EXPECT_NE(problems_of(bad).find("density with variant paper"), std::string::npos);
  bad = foveated(RenderMode::pt);
  bad.device.kind = RenderDevice::Kind::vulkan;
  EXPECT_NE(problems_of(bad).find("density with device vulkan"), std::string::npos);
  bad = foveated(RenderMode::pt);
  bad.foveation.viewing_distance = 0.1;
  EXPECT_NE(problems_of(bad).find("viewing_distance: 0.1; allowed: [0.25, 20]"), std::string::npos);
  bad = foveated(RenderMode::pt, Foveation::paper);
  EXPECT_EQ(problems_of(bad), "");  // the viewing distance is not looked at
  bad.foveation.published.disk = 0.001;
  EXPECT_NE(problems_of(bad).find("foveation_paper.disk: 0.001; allowed: [0.01, 1]"), std::string::npos);
  bad.foveation.published.disk = std::nan("");
  EXPECT_NE(problems_of(bad).find("foveation_paper.disk"), std::string::npos);
  View view;
  view.camera = kHome;
  for (const double x : {std::nan(""), 2e6, -HUGE_VAL}) {
    view.gaze = Gaze{x, 3};
    Problems problems;
    validate(view, "view", problems);
    ASSERT_EQ(problems.size(), 1u);
    EXPECT_NE(problems.to_error().to_string().find("view.gaze.x"), std::string::npos);
  }
}

// A gaze that moves while the last tiles go out, whose frame has its end already.
TEST(FoveatedLoop, AMoveDuringTheLastTilesIsNotLost) {
  RenderEngine engine(2);
  const auto scene = build(lambert_room());
  const auto sink = std::make_shared<RecordingSink>();
  RenderLoop loop(engine, scene, foveated(RenderMode::pt), {}, RenderRank::interactive, sink);
  std::atomic<int> moves = 0;
  sink->on_tile = [&](const FrameTile& tile) {
    if (tile.final && moves++ == 0) loop.move_gaze(Gaze{88, 32});
  };
  RenderLoop::Update update;
  update.view = View{1, kHome};
  update.view->gaze = Gaze{16, 32};
  update.budget = Budget{};
  update.budget->samples = 64;
  loop.update(update);
  ASSERT_TRUE(sink->wait([&] { return sink->ends.size() == 2; }));
  EXPECT_GT(sink->ends[1].progress.samples_per_pixel, sink->ends[0].progress.samples_per_pixel);
  EXPECT_EQ(sink->ends[1].reason, FrameEndReason::samples);
  loop.cancel();
}

// Films are those of no foveation, also where it is switched on in the middle; previews have a history of their own.
TEST(PublishedFoveation, ChangesNoFilm) {
  RenderEngine engine(2);
  const auto scene = build(lambert_room());
  RenderSettings plain = foveated(RenderMode::pt, Foveation::none), published = plain;
  published.foveation.kind = Foveation::paper;
  EXPECT_TRUE(same_pictures(plain, published));
  EXPECT_FALSE(same_pictures(foveated(RenderMode::pt), published));
  EXPECT_FALSE(counts_differ(published));
  LoopViews without(engine, scene, plain), with(engine, scene, published);
  with.gaze = Gaze{20, 32};
  const ViewPicture expected = without.render(kHome, 16), &found = with.render(kHome, 16);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(found.radiance[c], expected.radiance[c]);

  plain.preview.rate = published.preview.rate = 30;
  const auto sink = std::make_shared<RecordingSink>();
  RenderLoop loop(engine, scene, plain, {}, RenderRank::interactive, sink);
  const std::size_t ours = loop.memory_bytes();
  RenderLoop::Update update;
  update.settings = published;
  EXPECT_FALSE(loop.previews_suit(published));
  loop.update(update);
  EXPECT_TRUE(loop.previews_suit(published));
  EXPECT_GT(loop.memory_bytes(), ours);
  published.foveation.published.reject_history = true;
  EXPECT_TRUE(loop.previews_suit(published));
  update.settings = plain;
  loop.update(update);
  EXPECT_EQ(loop.memory_bytes(), ours);
}

}  // namespace
}  // namespace helio::test
