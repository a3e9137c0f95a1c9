// The loop's promises to its sink, with radiance from a hash.
#include "renderer/frame/render_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <thread>

#include "fake_integrator.h"
#include "latency.h"
#include "recording_sink.h"

namespace helio {
namespace {

Budget samples(std::uint32_t n) {
  Budget budget;
  budget.samples = n;
  return budget;
}

Budget seconds(double s) {
  Budget budget;
  budget.time_s = s;
  return budget;
}

RenderLoop::Update view_update(std::uint64_t id, double x) {
  RenderLoop::Update update;
  update.view = view_at(id, x);
  return update;
}

RenderLoop::Update budget_update(const Budget& budget) {
  RenderLoop::Update update;
  update.budget = budget;
  return update;
}

class RenderLoopTest : public ::testing::Test {
 protected:
  std::unique_ptr<RenderLoop> make(const RenderSettings& settings, const Budget& budget,
                                   RenderRank rank = RenderRank::interactive, const RenderLoopOptions& options = {}) {
    return std::make_unique<RenderLoop>(engine, integrator.function(), settings, budget, rank, sink, options);
  }

  // Windows that got a final tile in the frame, each exactly once, and that nothing came after it.
  void expect_final_cover(std::uint64_t frame, const PixelRect& region) {
    std::map<std::pair<int, int>, int> finals;
    std::int64_t area = 0;
    for (const auto& tile : sink->tiles) {
      if (tile.tag.frame != frame) continue;
      int& count = finals[{tile.window.x0, tile.window.y0}];
      EXPECT_EQ(count, 0) << "a tile was published after its final state";
      if (!tile.final) continue;
      ++count;
      area += tile.window.area();
      EXPECT_EQ(tile.window, intersect(tile.window, region));
    }
    EXPECT_EQ(area, region.area());
  }

  RenderEngine engine{2};
  std::shared_ptr<RecordingSink> sink = std::make_shared<RecordingSink>();
  FakeIntegrator integrator;
};

TEST_F(RenderLoopTest, NothingHappensWithoutAView) {
  const auto loop = make(film_of(64, 64), samples(4));
  EXPECT_EQ(loop->revision(), 0u);
  EXPECT_EQ(loop->update(budget_update(samples(8))), 1u);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_TRUE(sink->read([&] { return sink->begins.empty() && sink->tiles.empty() && sink->ends.empty(); }));
}

TEST_F(RenderLoopTest, AFrameIsBegunShownInRoundsAndEnded) {
  RenderLoopOptions options;
  options.publish_interval_s = 1e6;  // at powers of two alone, however slow the machine
  const auto loop = make(film_of(300, 200), samples(16), RenderRank::interactive, options);
  const double asked = now_s();
  const std::uint64_t revision = loop->update(view_update(5, 1));
  const auto end = sink->wait_for_end(revision);
  ASSERT_TRUE(end.has_value());
  const double seen = now_s();
  EXPECT_EQ(end->reason, FrameEndReason::samples);
  EXPECT_EQ(end->tag.view_id, 5u);
  EXPECT_EQ(end->progress.samples_per_pixel, 16u);
  EXPECT_EQ(end->progress.trace.paths, 300u * 200 * 16);
  EXPECT_EQ(end->progress.budget_used, 1);
  EXPECT_TRUE(end->progress.error.known);
  EXPECT_GT(end->progress.samples_per_second, 0);
  EXPECT_GT(end->first_tile_seconds, 0);
  EXPECT_LE(end->first_tile_seconds, seen - asked);
  ASSERT_EQ(end->passes.size(), 4u);
  for (const PassTime& pass : end->passes) EXPECT_GT(pass.seconds, 0) << pass.pass;

  ASSERT_EQ(sink->begins.size(), 1u);
  EXPECT_EQ(sink->begins[0].region, (PixelRect{0, 0, 300, 200}));
  EXPECT_EQ(sink->begins[0].tag.view_id, 5u);
  // 3 x 2 tiles; rounds after 1, 2, 4, 8 and the final 16 samples.
  ASSERT_EQ(sink->tiles.size(), 6u * 5);
  for (std::size_t i = 0; i < sink->tiles.size(); ++i) {
    const auto& tile = sink->tiles[i];
    EXPECT_EQ(tile.pass, i / 6);
    EXPECT_EQ(tile.samples_per_pixel, 1u << (i / 6));
    EXPECT_EQ(tile.final, i / 6 == 4);
    EXPECT_EQ(tile.tag.revision, revision);
  }
  expect_final_cover(1, {0, 0, 300, 200});
  EXPECT_EQ(integrator.counters->out_of_order, 0u);
  EXPECT_EQ(integrator.counters->samples, 300u * 200 * 16);
  EXPECT_GE(loop->memory_bytes(), Film(300, 200).bytes());
  EXPECT_GT(loop->used_seconds(), 0);
}

TEST_F(RenderLoopTest, SampleBudgetsAreExact) {
  for (const std::uint32_t n : {1u, 2u, 3u, 5u, 7u, 33u}) {
    sink = std::make_shared<RecordingSink>();
    sink->keep_pixels = true;
    integrator = {};
    const auto loop = make(film_of(50, 40), samples(n));
    const auto end = sink->wait_for_end(loop->update(view_update(1, 0)));
    ASSERT_TRUE(end.has_value());
    EXPECT_EQ(end->progress.samples_per_pixel, n);
    EXPECT_EQ(integrator.counters->samples, 50u * 40 * n);
    expect_final_cover(1, {0, 0, 50, 40});
    for (const float count : sink->pixels.back().samples) EXPECT_EQ(count, float(n));
  }
}

TEST_F(RenderLoopTest, TheFirstTileDoesNotWaitForTheFrame) {
  integrator.seconds_per_sample = 2e-6;
  std::optional<std::uint64_t> traced;  // when the first tile is shown
  sink->on_tile = [&](const FrameTile&) {
    if (!traced) traced = integrator.counters->samples;
  };
  const auto loop = make(film_of(640, 640), samples(1));
  const auto end = sink->wait_for_end(loop->update(view_update(1, 0)));
  ASSERT_TRUE(end.has_value());
  // The picture has 25 tiles. Few may be done and wait to be shown; then the workers wait.
  ASSERT_TRUE(traced.has_value());
  EXPECT_LE(*traced, 640u * 640 / 2);
  EXPECT_FALSE(intersect(sink->tiles[0].window, PixelRect{128, 128, 512, 512}).empty()) << "the middle first";
  EXPECT_EQ(sink->tiles.size(), 25u);
}

TEST_F(RenderLoopTest, OnlyTheRegionIsRendered) {
  RenderSettings settings = film_of(200, 150);
  settings.region = PixelRect{33, 41, 170, 99};
  const auto loop = make(settings, samples(4));
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(1, 0))));
  EXPECT_EQ(integrator.counters->samples, std::uint64_t(settings.region->area()) * 4);
  EXPECT_EQ(sink->begins[0].region, *settings.region);
  expect_final_cover(1, *settings.region);
}

TEST_F(RenderLoopTest, ExtremeFilms) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 13}, {16384, 1}, {1, 5000}}) {
    sink = std::make_shared<RecordingSink>();
    const auto loop = make(film_of(width, height), samples(8));
    const auto end = sink->wait_for_end(loop->update(view_update(1, 0)));
    ASSERT_TRUE(end.has_value());
    EXPECT_EQ(end->progress.trace.paths, std::uint64_t(width) * std::uint64_t(height) * 8);
    expect_final_cover(1, {0, 0, width, height});
  }
}

TEST_F(RenderLoopTest, TileSizeAndChannelsAreChosen) {
  RenderLoopOptions options;
  options.tile_size = 48;
  options.channels = kResolveAlbedo;
  sink->keep_pixels = true;
  const auto loop = make(film_of(96, 96), samples(2), RenderRank::interactive, options);
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(1, 0))));
  EXPECT_EQ(sink->tiles.size(), 2u * 4);
  EXPECT_EQ(sink->pixels[0].albedo[2].size(), 48u * 48);
  EXPECT_TRUE(sink->pixels[0].variance[0].empty());
  RenderLoop::Update update;
  update.channels = kResolveVariance | kResolveDepth;
  ASSERT_TRUE(sink->wait_for_end(loop->update(update)));
  EXPECT_TRUE(sink->pixels.back().albedo[2].empty());
  EXPECT_EQ(sink->pixels.back().variance[0].size(), 48u * 48);
  EXPECT_EQ(sink->pixels.back().depth.size(), 48u * 48);
  EXPECT_EQ(integrator.counters->samples, 96u * 96 * 2) << "other channels need no other samples";
}

TEST_F(RenderLoopTest, JobsAreShownOnce) {
  const auto loop = make(film_of(100, 100), samples(64), RenderRank::job);
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(1, 0))));
  EXPECT_EQ(sink->tiles.size(), 1u);
  expect_final_cover(1, {0, 0, 100, 100});
  RenderLoopOptions options;
  options.publish_passes = true;
  options.publish_interval_s = 1e6;
  sink = std::make_shared<RecordingSink>();
  const auto shown = make(film_of(100, 100), samples(64), RenderRank::job, options);
  ASSERT_TRUE(sink->wait_for_end(shown->update(view_update(1, 0))));
  EXPECT_EQ(sink->tiles.size(), 7u);
}

TEST_F(RenderLoopTest, TimeBudgetEndsOnTime) {
  integrator.seconds_per_sample = 1e-6;
  for (const double budget : {0.05, 0.3}) {
    sink = std::make_shared<RecordingSink>();
    const auto loop = make(film_of(256, 256), seconds(budget));
    const auto end = sink->wait_for_end(loop->update(view_update(1, 0)));
    ASSERT_TRUE(end.has_value());
    EXPECT_EQ(end->reason, FrameEndReason::time);
    EXPECT_GT(end->progress.seconds, budget / 2);
    // No piece begins after the time is over, but for one of each worker that the machine held up after it had looked
    // at the clock; the frame's clock started a little before its beginning was told.
    const auto& calls = integrator.counters->calls_s;
    const double over = sink->begin_times[0] + budget + 0.002;
    EXPECT_LE(std::count_if(calls.begin(), calls.end(), [&](double at) { return at > over; }), 2);
    EXPECT_EQ(end->progress.budget_used, std::min(1.0, end->progress.seconds / budget));
    expect_final_cover(1, {0, 0, 256, 256});
  }
}

TEST_F(RenderLoopTest, TimeBudgetMayEndBeforeAllTilesHaveSamples) {
  integrator.seconds_per_sample = 20e-6;
  sink->keep_pixels = true;
  const auto loop = make(film_of(512, 512), seconds(0.1));  // one sample of all would take 2.6 s
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(1, 0))));
  const auto end = sink->wait_for_end(loop->update(view_update(2, 1)));  // the film now holds an older picture
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->reason, FrameEndReason::time);
  EXPECT_EQ(end->progress.samples_per_pixel, 0u);
  EXPECT_FALSE(end->progress.error.known);
  expect_final_cover(2, {0, 0, 512, 512});
  double shown = 0;
  for (std::size_t i = 0; i < sink->tiles.size(); ++i) {
    if (sink->tiles[i].tag.frame != 2 || !sink->tiles[i].final) continue;
    for (const float n : sink->pixels[i].samples) shown += n;
  }
  // What the second frame traced, none of it from the first.
  EXPECT_EQ(shown, double(end->progress.trace.paths));
}

TEST_F(RenderLoopTest, ErrorBudgetStopsNearItsTarget) {
  // Radiance 0.5 + 0.5 (2u - 1): standard deviation 0.5 / sqrt(3). A target of 0.02 needs 208 samples.
  Budget budget;
  budget.error = 0.02;
  const auto loop = make(film_of(128, 128), budget);
  const auto end = sink->wait_for_end(loop->update(view_update(1, 0)));
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->reason, FrameEndReason::error);
  EXPECT_LE(end->progress.error.rmse, 0.02);
  EXPECT_GE(end->progress.samples_per_pixel, 200u);
  EXPECT_LE(end->progress.samples_per_pixel, 232u);
}

TEST_F(RenderLoopTest, ABlackPictureDoesNotConverge) {
  integrator.mean = integrator.noise = 0;
  Budget budget = samples(256);
  budget.error = 1e-3;
  const auto loop = make(film_of(64, 64), budget);
  const auto end = sink->wait_for_end(loop->update(view_update(1, 0)));
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->reason, FrameEndReason::samples);
  EXPECT_EQ(end->progress.error.unproven, 1);
  EXPECT_TRUE(std::isinf(end->progress.error.hidden_rmse));
}

TEST_F(RenderLoopTest, APictureThatMissesEverythingIsBlackAndEnds) {
  integrator.mean = integrator.noise = 0;
  integrator.misses = true;
  Budget budget = samples(4096);
  budget.error = 1e-3;
  const auto loop = make(film_of(64, 64), budget);
  const auto end = sink->wait_for_end(loop->update(view_update(1, 0)));
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->reason, FrameEndReason::error);
  EXPECT_EQ(end->progress.error.unproven, 0);
}

TEST_F(RenderLoopTest, InvalidSamplesAreCountedAndNeverConverge) {
  integrator.invalid_share = 1;
  Budget budget = samples(32);
  budget.error = 1e6;
  sink->keep_pixels = true;
  const auto loop = make(film_of(64, 64), budget);
  const auto end = sink->wait_for_end(loop->update(view_update(1, 0)));
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->reason, FrameEndReason::samples);
  EXPECT_EQ(end->progress.trace.invalid_samples, 64u * 64 * 32);
  EXPECT_EQ(sink->pixels.back().invalid_samples, 64u * 64 * 32);
  EXPECT_FALSE(end->progress.error.known);
}

// One pixel without a valid sample says nothing of itself: it must not end the frame as if it were known.
TEST_F(RenderLoopTest, OnePixelOfInvalidSamplesAloneKeepsTheFrameGoing) {
  Budget budget = samples(64);
  budget.error = 1e6;
  const auto sound = make(film_of(64, 64), budget);
  const auto early = sink->wait_for_end(sound->update(view_update(1, 0)));
  ASSERT_TRUE(early.has_value());
  EXPECT_EQ(early->reason, FrameEndReason::error);
  integrator.lost = {40, 50};
  sink = std::make_shared<RecordingSink>();
  const auto loop = make(film_of(64, 64), budget);
  const auto end = sink->wait_for_end(loop->update(view_update(1, 0)));
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->reason, FrameEndReason::samples);
  EXPECT_EQ(end->progress.trace.invalid_samples, 64u);
  EXPECT_EQ(end->progress.trace.first_invalid, (InvalidSample{40, 50, 0, 0}));
  EXPECT_FALSE(end->progress.error.known);
}

// A new view clears the film and its counts; the loop remembers.
TEST_F(RenderLoopTest, InvalidSamplesAreCountedOverAllFrames) {
  integrator.lost = {3, 3};
  const auto loop = make(film_of(64, 64), samples(8));
  for (std::uint64_t i = 1; i <= 3; ++i) {
    const auto end = sink->wait_for_end(loop->update(view_update(i, double(i))));
    ASSERT_TRUE(end.has_value());
    EXPECT_EQ(end->progress.trace.invalid_samples, 8u);
    EXPECT_EQ(loop->invalid_samples(), 8u * i);
    EXPECT_EQ(sink->begins.back().camera.position.x, double(i));
  }
}

// Of all loops, whatever became of their pictures; pieces that a newer view cut short are in no film.
TEST_F(RenderLoopTest, TheEngineCountsWhatWentIntoFilms) {
  integrator.seconds_per_sample = 0.2e-6;
  integrator.invalid_share = 0.01;
  std::uint64_t invalid = 0;
  for (int round = 0; round < 2; ++round) {
    const auto loop = make(film_of(256, 256), samples(16));
    for (int i = 1; i <= 20; ++i) {
      loop->update(view_update(std::uint64_t(i), i));
      std::this_thread::sleep_for(std::chrono::milliseconds(i % 7));
    }
    ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(21, 0))));
    invalid += loop->invalid_samples();
    sink = std::make_shared<RecordingSink>();
  }
  const RenderTotals totals = engine.totals();
  EXPECT_GT(integrator.counters->cancelled, 0u);
  EXPECT_EQ(totals.samples, integrator.counters->samples);
  EXPECT_EQ(totals.rays, integrator.counters->samples);
  EXPECT_EQ(totals.invalid_samples, invalid);
}

// changed_s: of frames that show another picture than the one before.
TEST_F(RenderLoopTest, AFrameTellsWhenItsPictureWasAskedFor) {
  const auto loop = make(film_of(64, 64), samples(4));
  const double before = now_s();
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(1, 0))));
  const double between = now_s();
  ASSERT_TRUE(sink->wait_for_end(loop->update(budget_update(samples(8)))));
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(2, 0))));  // the same camera
  loop->republish();
  ASSERT_TRUE(sink->wait([&] { return sink->ends.size() == 4; }));
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(3, 1))));
  ASSERT_EQ(sink->begins.size(), 5u);
  EXPECT_GE(sink->begins[0].changed_s, before);
  EXPECT_LE(sink->begins[0].changed_s, between);
  for (const std::size_t i : {1, 2, 3}) EXPECT_EQ(sink->begins[i].changed_s, 0) << i;
  EXPECT_GE(sink->begins[4].changed_s, between);
}

TEST_F(RenderLoopTest, ANewViewSupersedesAndNoOlderTileFollows) {
  integrator.seconds_per_sample = 0.2e-6;
  const auto loop = make(film_of(256, 256), samples(64));
  std::uint64_t revision = 0;
  for (int i = 1; i <= 60; ++i) {
    revision = loop->update(view_update(std::uint64_t(i), i));
    EXPECT_EQ(revision, std::uint64_t(i));
    std::this_thread::sleep_for(std::chrono::milliseconds(i % 7));
  }
  const auto end = sink->wait_for_end(revision);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->reason, FrameEndReason::samples);
  EXPECT_EQ(end->progress.trace.paths, 256u * 256 * 64);
  ASSERT_EQ(sink->begins.size(), sink->ends.size());
  for (std::size_t i = 0; i + 1 < sink->ends.size(); ++i) {
    EXPECT_EQ(sink->ends[i].reason, FrameEndReason::superseded);
    EXPECT_EQ(sink->ends[i].tag.frame, sink->begins[i].tag.frame);
  }
  EXPECT_EQ(integrator.counters->out_of_order, 0u) << "samples were mixed into a film that was not cleared";
  expect_final_cover(end->tag.frame, {0, 0, 256, 256});
}

TEST_F(RenderLoopTest, AnUpdateMayWaitForTheNext) {
  const auto loop = make(film_of(64, 64), samples(4));
  RenderLoop::Update waits = view_update(1, 1);
  waits.begin = false;
  EXPECT_EQ(loop->update(waits), 1u);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(loop->update(budget_update(samples(8))), 2u);
  const auto end = sink->wait_for_end(2);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->progress.samples_per_pixel, 8u);
  EXPECT_EQ(sink->begins.size(), 1u) << "the first view began by itself";
}

TEST_F(RenderLoopTest, OtherSettingsClearTheFilm) {
  const auto loop = make(film_of(64, 64), samples(8));
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(1, 0))));
  RenderLoop::Update update;
  for (const auto& change : std::vector<std::function<void(RenderSettings&)>>{
           [](RenderSettings& s) { s.seed = 1; }, [](RenderSettings& s) { s.max_segments = 3; },
           [](RenderSettings& s) { s.width = 90; },
           [](RenderSettings& s) {
             s.region = PixelRect{1, 2, 40, 50};
           },
           [](RenderSettings& s) { s.region.reset(); }}) {
    RenderSettings settings = update.settings.value_or(film_of(64, 64));
    change(settings);
    update.settings = settings;
    const std::uint64_t before = integrator.counters->samples;
    const auto end = sink->wait_for_end(loop->update(update));
    ASSERT_TRUE(end.has_value());
    EXPECT_EQ(integrator.counters->samples - before, std::uint64_t(settings.rendered_region().area()) * 8);
    EXPECT_EQ(end->progress.trace.paths, std::uint64_t(settings.rendered_region().area()) * 8);
    expect_final_cover(end->tag.frame, settings.rendered_region());
  }
  EXPECT_EQ(integrator.counters->out_of_order, 0u);
}

TEST_F(RenderLoopTest, AnIdenticalViewKeepsTheFilm) {
  const auto loop = make(film_of(128, 128), samples(16));
  sink->keep_pixels = true;
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(1, 3))));
  const std::size_t first = sink->read([&] { return sink->tiles.size(); });
  const auto end = sink->wait_for_end(loop->update(view_update(2, 3)));
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->tag.view_id, 2u);
  EXPECT_EQ(end->progress.samples_per_pixel, 16u);
  EXPECT_EQ(integrator.counters->samples, 128u * 128 * 16);
  ASSERT_EQ(sink->tiles.size(), first + 1) << "shown once, at once, as final";
  EXPECT_TRUE(sink->tiles.back().final);
  EXPECT_EQ(sink->pixels.back().radiance[0], sink->pixels[first - 1].radiance[0]);
}

TEST_F(RenderLoopTest, ALargerBudgetGoesOn) {
  const auto loop = make(film_of(64, 64), samples(6));
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(1, 3))));
  const auto end = sink->wait_for_end(loop->update(budget_update(samples(10))));
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->progress.samples_per_pixel, 10u);
  EXPECT_EQ(integrator.counters->samples, 64u * 64 * 10);
  EXPECT_EQ(integrator.counters->out_of_order, 0u);
  const auto smaller = sink->wait_for_end(loop->update(budget_update(samples(2))));
  ASSERT_TRUE(smaller.has_value());
  EXPECT_EQ(smaller->reason, FrameEndReason::samples);
  EXPECT_EQ(integrator.counters->samples, 64u * 64 * 10);
}

TEST_F(RenderLoopTest, ABudgetChangeInFlightLosesAndRepeatsNothing) {
  integrator.seconds_per_sample = 0.5e-6;
  const auto loop = make(film_of(200, 200), samples(1000));
  loop->update(view_update(1, 3));
  std::uint64_t revision = 0;
  for (std::uint32_t i = 0; i < 20; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    revision = loop->update(budget_update(samples(20 + i % 2)));
  }
  const auto end = sink->wait_for_end(revision);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(integrator.counters->out_of_order, 0u);
  EXPECT_GE(end->progress.samples_per_pixel, 21u);
  EXPECT_EQ(end->progress.trace.paths, integrator.counters->samples);
}

TEST_F(RenderLoopTest, CancelEndsTheFrameUntilTheNextUpdate) {
  integrator.seconds_per_sample = 1e-6;
  const auto loop = make(film_of(128, 128), {});
  const std::uint64_t revision = loop->update(view_update(1, 0));
  ASSERT_TRUE(sink->wait([&] { return sink->tiles.size() > 6; }));
  loop->cancel();
  const auto end = sink->wait_for_end(revision);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->reason, FrameEndReason::cancelled);
  EXPECT_GT(end->progress.samples_per_pixel, 0u);
  EXPECT_EQ(loop->progress().tag.frame, end->tag.frame);
  const std::uint64_t traced = integrator.counters->samples;
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  EXPECT_EQ(integrator.counters->samples, traced);
  loop->cancel();  // nothing to cancel: nothing happens
  const auto again = sink->wait_for_end(loop->update(budget_update(samples(end->progress.samples_per_pixel + 8))));
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->reason, FrameEndReason::samples);
  EXPECT_EQ(integrator.counters->out_of_order, 0u);
}

TEST_F(RenderLoopTest, RepublishShowsAnEndedPictureAsAFrameOfItsOwn) {
  const auto loop = make(film_of(200, 100), samples(4));
  sink->keep_pixels = true;
  loop->republish();  // no samples: nothing
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(7, 0))));
  const std::size_t before = sink->tiles.size();
  const ResolvedTile last = sink->pixels.back();
  loop->republish();
  ASSERT_TRUE(sink->wait([&] { return sink->ends.size() == 2; }));
  EXPECT_EQ(sink->begins[1].tag.view_id, 7u);
  EXPECT_EQ(sink->begins[1].tag.revision, sink->begins[0].tag.revision);
  EXPECT_EQ(sink->ends[1].reason, FrameEndReason::samples);
  EXPECT_EQ(sink->ends[1].progress.samples_per_pixel, 4u);
  EXPECT_EQ(sink->tiles.size(), before + 2);
  expect_final_cover(2, {0, 0, 200, 100});
  for (const ResolvedTile& tile : sink->pixels) {
    if (&tile >= &sink->pixels[before] && tile.window == last.window) {
      EXPECT_EQ(tile.radiance[1], last.radiance[1]);
    }
  }
  EXPECT_EQ(integrator.counters->samples, 200u * 100 * 4);
}

TEST_F(RenderLoopTest, RepublishShowsAJobThatIsStillRunning) {
  integrator.seconds_per_sample = 1e-6;
  const auto loop = make(film_of(128, 128), {}, RenderRank::job);
  loop->update(view_update(1, 0));
  while (loop->progress().samples_per_pixel < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(sink->read([&] { return sink->tiles.empty(); }));
  loop->republish();
  EXPECT_TRUE(sink->wait([&] { return !sink->tiles.empty(); }));
  EXPECT_FALSE(sink->read([&] { return sink->tiles[0].final; }));
}

TEST_F(RenderLoopTest, AThrowingIntegratorFailsTheFrameAndOnlyIt) {
  integrator.throw_after = 64 * 64 * 3;
  const auto loop = make(film_of(64, 64), samples(16));
  const auto end = sink->wait_for_end(loop->update(view_update(1, 0)));
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->reason, FrameEndReason::failed);
  EXPECT_EQ(end->message, "the ray got lost");
  integrator.counters->samples = 0;
  RenderLoop::Update update = view_update(2, 0);
  update.budget = samples(2);
  const auto next = sink->wait_for_end(loop->update(update));
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->reason, FrameEndReason::samples);
  EXPECT_EQ(next->progress.trace.paths, 64u * 64 * 2) << "the film of a failed frame is not to be trusted";
}

// A sink that throws when it is told one thing, so many times, before it notes it.
struct ThrowingSink final : FrameSink {
  enum class At { begin, tile, end, backlog } at;
  std::atomic<int> left;
  RecordingSink& next;

  ThrowingSink(At where, int times, RecordingSink& sink) : at(where), left(times), next(sink) {}
  void raise_at(At here) {
    if (here == at && left > 0 && left-- > 0) throw std::runtime_error("the sink is full");
  }
  void frame_begun(const FrameBegin& begin) override {
    next.frame_begun(begin);
    raise_at(At::begin);
  }
  void tile_ready(FrameTile tile) override {
    raise_at(At::tile);
    next.tile_ready(std::move(tile));
  }
  void frame_ended(const FrameEnd& end) override {
    raise_at(At::end);
    next.frame_ended(end);
  }
  std::size_t backlog() const override {
    const_cast<ThrowingSink*>(this)->raise_at(At::backlog);
    return 0;
  }
};

TEST_F(RenderLoopTest, AThrowingSinkFailsTheFrameAndOnlyIt) {
  for (const auto at :
       {ThrowingSink::At::begin, ThrowingSink::At::tile, ThrowingSink::At::end, ThrowingSink::At::backlog}) {
    SCOPED_TRACE(int(at));
    sink = std::make_shared<RecordingSink>();
    const auto throwing = std::make_shared<ThrowingSink>(at, 1, *sink);
    RenderLoop loop(engine, integrator.function(), film_of(64, 64), samples(4), RenderRank::interactive, throwing);
    const auto end = sink->wait_for_end(loop.update(view_update(1, 0)));
    ASSERT_TRUE(end.has_value());
    EXPECT_EQ(end->reason, FrameEndReason::failed);
    EXPECT_EQ(end->message, "the sink is full");
    EXPECT_EQ(end->tag.view_id, 1u);
    const auto next = sink->wait_for_end(loop.update(view_update(2, 1)));
    ASSERT_TRUE(next.has_value());
    EXPECT_EQ(next->reason, FrameEndReason::samples);
    EXPECT_EQ(next->progress.samples_per_pixel, 4u);
    expect_final_cover(next->tag.frame, {0, 0, 64, 64});
  }
  EXPECT_EQ(integrator.counters->out_of_order, 0u);
}

TEST_F(RenderLoopTest, ASinkThatNeverTakesAnEndIsGivenUp) {
  const auto throwing = std::make_shared<ThrowingSink>(ThrowingSink::At::end, 1000000, *sink);
  RenderLoop loop(engine, integrator.function(), film_of(64, 64), samples(4), RenderRank::interactive, throwing);
  loop.update(view_update(1, 0));
  ASSERT_TRUE(sink->wait([&] { return !sink->tiles.empty() && sink->tiles.back().final; }));
  while (throwing->left > 1000000 - 8) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(throwing->left, 1000000 - 8);
}

TEST_F(RenderLoopTest, ASlowReaderGetsLessOften) {
  sink->backlog_tiles = 1000;
  const auto loop = make(film_of(128, 128), samples(1024));
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(1, 0))));
  ASSERT_EQ(sink->tiles.size(), 2u) << "the first look and the final state";
  EXPECT_TRUE(sink->tiles[1].final);
}

TEST_F(RenderLoopTest, ASlowSinkHoldsBackLittleMemory) {
  std::atomic<std::size_t> most{0};
  const auto loop = make(film_of(1024, 1024), samples(2));
  const std::size_t empty = loop->memory_bytes();
  sink->on_tile = [&](const FrameTile&) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    most = std::max(most.load(), loop->memory_bytes());
  };
  ASSERT_TRUE(sink->wait_for_end(loop->update(view_update(1, 0))));
  // Tiles of 128 x 128 x 7 floats, at most 2 + 2 x 2 threads waiting and one being handed over; the grid beside them.
  EXPECT_LE(most - empty, 7u * 128 * 128 * 7 * 4 + (1u << 20));
  sink->on_tile = {};
}

TEST_F(RenderLoopTest, DestructionInFlightEndsAtOnceAndSilently) {
  integrator.seconds_per_sample = 1e-5;
  auto loop = make(film_of(512, 512), {});
  loop->update(view_update(1, 0));
  ASSERT_TRUE(sink->wait([&] { return !sink->begins.empty(); }));
  const double before = process_cpu_s();
  loop.reset();
  EXPECT_LT(process_cpu_s() - before, allowed_work_s(2));
  const auto calls = [&] { return sink->tiles.size() + sink->begins.size() + sink->ends.size(); };
  const std::size_t told = sink->read(calls);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(sink->read(calls), told);
}

TEST_F(RenderLoopTest, TheSinkMayUpdateTheLoop) {
  const auto loop = make(film_of(128, 128), samples(4));
  std::atomic<int> views{0};
  sink->on_tile = [&](const FrameTile& tile) {
    if (tile.final && ++views < 5) loop->update(view_update(std::uint64_t(views + 1), views));
  };
  loop->update(view_update(1, 0));
  EXPECT_TRUE(sink->wait([&] { return !sink->ends.empty() && sink->ends.back().tag.view_id == 5; }));
  EXPECT_EQ(sink->read([&] { return sink->ends.back().reason; }), FrameEndReason::samples);
  sink->on_tile = {};
}

TEST_F(RenderLoopTest, ManyThreadsMayCallAtOnce) {
  integrator.seconds_per_sample = 0.1e-6;
  const auto loop = make(film_of(96, 96), samples(32));
  std::vector<std::thread> callers;
  for (int t = 0; t < 4; ++t) {
    callers.emplace_back([&, t] {
      for (int i = 0; i < 50; ++i) {
        switch ((i + t) % 5) {
          case 0:
            loop->update(view_update(std::uint64_t(i), i));
            break;
          case 1:
            loop->cancel();
            break;
          case 2:
            loop->republish();
            break;
          case 3: {
            RenderLoop::Update update;
            update.settings = film_of(80 + i, 96);
            loop->update(update);
            break;
          }
          case 4:
            EXPECT_LE(loop->progress().budget_used + double(loop->memory_bytes() == 0), 1);
            break;
        }
        std::this_thread::sleep_for(std::chrono::microseconds(300));
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  const std::uint64_t revision = loop->update(view_update(1000, -1));
  const auto end = sink->wait_for_end(revision);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->reason, FrameEndReason::samples);
  EXPECT_EQ(integrator.counters->out_of_order, 0u);
}

}  // namespace
}  // namespace helio
