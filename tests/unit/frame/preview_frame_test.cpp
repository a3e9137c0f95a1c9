// Previews through the render loop: frames of their own beside a film that does not know of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <stdexcept>
#include <thread>

#include "fake_integrator.h"
#include "recording_sink.h"
#include "renderer/frame/render_loop.h"
#include "renderer/preview/preview_history.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 160, kHeight = 96;

RenderSettings settings_of(RenderMode mode, double rate) {
  RenderSettings settings = loop_settings(kWidth, kHeight, mode);
  settings.preview.rate = rate;
  settings.preview.budget_s = 0.005;
  return settings;
}

CameraPose home(double degrees = 0) {
  return turned_and_shifted(camera_at({0.1, 0.1, 0.9}, {0, -0.2, -1}, 60), degrees, 0);
}

// Frames of the sink, by number.
struct Frame {
  FrameBegin begin;
  std::vector<RecordingSink::TileRecord> tiles;
  const FrameEnd* end = nullptr;

  std::int64_t area() const {
    std::int64_t pixels = 0;
    for (const auto& tile : tiles) pixels += tile.window.area();
    return pixels;
  }
};
std::map<std::uint64_t, Frame> frames_of(const RecordingSink& sink) {
  std::map<std::uint64_t, Frame> frames;
  for (const FrameBegin& begin : sink.begins) frames[begin.tag.frame].begin = begin;
  for (const auto& tile : sink.tiles) frames[tile.tag.frame].tiles.push_back(tile);
  for (const FrameEnd& end : sink.ends) frames[end.tag.frame].end = &end;
  return frames;
}

class PreviewFrame : public testing::Test {
 protected:
  RenderEngine engine{2};
  std::shared_ptr<const RenderScene> room = build(lambert_room()), mixed = build(mixed_scene());
  std::shared_ptr<RecordingSink> sink = std::make_shared<RecordingSink>();

  static RenderLoop::Update view_of(std::uint64_t id, double degrees, std::uint32_t samples = 4) {
    RenderLoop::Update update;
    update.view = View{id, home(degrees)};
    update.budget = Budget{};
    update.budget->samples = samples;
    return update;
  }
  // The end of the film's frame of this revision.
  bool film_ended(std::uint64_t revision) {
    return sink->wait([&] {
      return std::any_of(sink->ends.begin(), sink->ends.end(), [&](const FrameEnd& end) {
        return end.tag.revision >= revision && end.reason != FrameEndReason::preview;
      });
    });
  }
};

TEST_F(PreviewFrame, EachRestingViewShowsAWholePreviewAndThenItsFilm) {
  RenderLoop loop(engine, room, settings_of(RenderMode::pt, 60), {}, RenderRank::interactive, sink);
  for (std::uint64_t id = 1; id <= 3; ++id) ASSERT_TRUE(film_ended(loop.update(view_of(id, double(id)))));
  const auto frames = frames_of(*sink);
  ASSERT_EQ(frames.size(), 6u);
  std::uint64_t number = 0;
  for (const auto& [frame, shown] : frames) {
    EXPECT_EQ(shown.begin.preview, number % 2 == 0);
    EXPECT_EQ(shown.begin.tag.view_id, number / 2 + 1);
    ASSERT_TRUE(shown.end);
    EXPECT_EQ(shown.end->reason, shown.begin.preview ? FrameEndReason::preview : FrameEndReason::samples);
    if (shown.begin.preview) {
      EXPECT_EQ(shown.area(), kWidth * kHeight);
      EXPECT_EQ(shown.end->progress.samples_per_pixel, 0u);
      EXPECT_GT(shown.end->first_tile_seconds, 0);
      std::vector<std::string> passes;
      for (const PassTime& pass : shown.end->passes) passes.push_back(pass.pass);
      EXPECT_EQ(passes, (std::vector<std::string>{"preview", "resolve", "publish"}));
    }
    ++number;
  }
}

TEST_F(PreviewFrame, FilmsHaveTheSameBitsWithAndWithoutPreviews) {
  for (const RenderMode mode : kEveryRenderMode) {
    std::vector<ViewPicture> pictures;
    for (const double rate : {0.0, 100.0}) {
      RenderSettings settings = settings_of(mode, rate);
      settings.width = 72;
      settings.height = 48;
      LoopViews views(engine, mixed, settings);
      for (const double degrees : {3.0, 0.5}) views.render(home(degrees), 4);
      pictures.push_back(views.render(home(), 8));
      EXPECT_EQ(views.previews(FrameEndReason::preview), rate > 0 ? 3 : 0);
    }
    EXPECT_TRUE(same_pixels(pictures[0], pictures[1])) << to_string(mode);
  }
}

TEST_F(PreviewFrame, AfterARestItShowsTheFilmAsItWasShown) {
  RenderLoopOptions options;
  options.channels = kResolveVariance | kResolveSamples | kResolveDisplay;
  sink->with_display = sink->keep_pixels = true;
  RenderLoop loop(engine, room, settings_of(RenderMode::pt, 60), {}, RenderRank::interactive, sink, options);
  ASSERT_TRUE(film_ended(loop.update(view_of(1, 0))));
  ASSERT_TRUE(film_ended(loop.update(view_of(2, 0.001))));
  const auto plane = [] { return std::vector<float>(std::size_t(kWidth * kHeight)); };
  std::vector<float> film = plane(), shown = plane(), preview = plane();
  for (std::size_t i = 0; i < sink->tiles.size(); ++i) {
    const ResolvedTile& pixels = sink->pixels[i];
    if (sink->tiles[i].tag.view_id == 2) {
      if (sink->tiles[i].preview) put_rows(pixels.display[1], pixels.window, kWidth, preview);
    } else if (!sink->tiles[i].preview) {
      put_rows(pixels.radiance[1], pixels.window, kWidth, film);
      put_rows(pixels.display[1], pixels.window, kWidth, shown);
    }
  }
  double from_film = 0, from_shown = 0;
  for (std::size_t i = 0; i < preview.size(); ++i) {
    from_film += double(preview[i] - film[i]) * (preview[i] - film[i]);
    from_shown += double(preview[i] - shown[i]) * (preview[i] - shown[i]);
  }
  EXPECT_LT(from_shown, 0.5 * from_film);
}

TEST_F(PreviewFrame, AMovingCameraShowsPreviewsAloneAndTheNewestViewAtLast) {
  RenderLoop loop(engine, room, settings_of(RenderMode::combined, 120), {}, RenderRank::interactive, sink);
  ASSERT_TRUE(film_ended(loop.update(view_of(1, 0))));
  std::uint64_t revision = 0;
  for (std::uint64_t id = 2; id <= 30; ++id) {
    revision = loop.update(view_of(id, 0.2 * double(id)));
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
  }
  ASSERT_TRUE(film_ended(revision));
  std::uint64_t newest = 0, previews = 0;
  for (const auto& [number, frame] : frames_of(*sink)) {
    if (!frame.begin.preview) continue;
    ++previews;
    EXPECT_GT(frame.begin.tag.view_id, newest);
    newest = frame.begin.tag.view_id;
    ASSERT_TRUE(frame.end);
    EXPECT_EQ(frame.end->reason, FrameEndReason::preview);
    EXPECT_EQ(frame.area(), kWidth * kHeight);  // whole, whatever came meanwhile
  }
  EXPECT_EQ(newest, 30u);
  EXPECT_GE(previews, 3u);
}

TEST_F(PreviewFrame, SizeRegionSceneAndSettingsMayChangeInTheMiddle) {
  RenderLoop loop(engine, room, settings_of(RenderMode::combined, 120), {}, RenderRank::interactive, sink);
  RenderLoop::Update update = view_of(1, 0);
  std::uint64_t revision = loop.update(update);
  RenderSettings settings = settings_of(RenderMode::combined, 120);
  for (int i = 0; i < 12; ++i) {
    update = view_of(std::uint64_t(i) + 2, i);
    if (i % 4 == 1) {
      settings.width = 100 + i;
      settings.region.reset();
    }
    if (i % 4 == 2) settings.region = PixelRect{10, 20, 70, 60};
    if (i % 4 == 3) settings.preview.rate = i == 7 ? 0 : 120;
    if (i % 3 == 2) settings.foveation.kind = i == 5 ? Foveation::none : Foveation::paper;
    settings.preview.upscaling = i % 2 == 1;
    if (i > 3) update.view->gaze = Gaze{7.0 * i, 90.0 - i};
    update.settings = settings;
    if (i % 5 == 4) update.scene = i == 4 ? mixed : room;
    revision = loop.update(update);
    std::this_thread::sleep_for(std::chrono::milliseconds(7));
  }
  settings.preview.rate = 120;
  update = view_of(20, 1);
  update.settings = settings;
  revision = loop.update(update);
  ASSERT_TRUE(film_ended(revision));
  for (const auto& [number, frame] : frames_of(*sink)) {
    ASSERT_TRUE(frame.end);
    EXPECT_NE(frame.end->reason, FrameEndReason::failed) << frame.end->message;
    if (frame.begin.preview) {
      EXPECT_EQ(frame.area(), frame.begin.region.area());
    }
  }
}

TEST_F(PreviewFrame, AChangeOfPreviewsAloneRestartsNothing) {
  RenderLoop loop(engine, room, settings_of(RenderMode::pt, 0), {}, RenderRank::interactive, sink);
  ASSERT_TRUE(film_ended(loop.update(view_of(1, 0, 16))));
  RenderLoop::Update update;
  update.settings = settings_of(RenderMode::pt, 30);
  const std::uint64_t revision = loop.update(update);
  ASSERT_TRUE(film_ended(revision));
  EXPECT_EQ(sink->ends.back().progress.samples_per_pixel, 16u);
  EXPECT_EQ(frames_of(*sink).size(), 2u);  // no preview: nothing has moved
}

TEST_F(PreviewFrame, CancelEndsAPreviewAndNothingFollows) {
  RenderLoop loop(engine, room, settings_of(RenderMode::pt, 120), {}, RenderRank::interactive, sink);
  for (std::uint64_t id = 1; id <= 20; ++id) {
    const std::uint64_t revision = loop.update(view_of(id, double(id)));
    loop.cancel();
    EXPECT_EQ(loop.revision(), revision);
  }
  ASSERT_TRUE(film_ended(loop.update(view_of(30, 3))));
  for (const auto& [number, frame] : frames_of(*sink)) {
    ASSERT_TRUE(frame.end);
    EXPECT_TRUE(frame.begin.preview || frame.begin.tag.view_id == 30);
  }
}

TEST_F(PreviewFrame, ASinkThatThrowsFailsThePreviewAndTheFilmComes) {
  sink->on_tile = [](const FrameTile& tile) {
    if (tile.preview) throw std::runtime_error("no room");
  };
  RenderLoop loop(engine, room, settings_of(RenderMode::pt, 60), {}, RenderRank::interactive, sink);
  const std::uint64_t revision = loop.update(view_of(1, 0));
  ASSERT_TRUE(sink->wait([&] { return sink->ends.size() >= 2; }));
  EXPECT_EQ(sink->ends[0].reason, FrameEndReason::failed);
  EXPECT_EQ(sink->ends[0].message, "no room");
  EXPECT_EQ(sink->ends[1].reason, FrameEndReason::samples);
  EXPECT_EQ(sink->ends[1].tag.revision, revision);
}

TEST_F(PreviewFrame, AViewEndsTheFilmAtOnce) {
  RenderLoop loop(engine, room, settings_of(RenderMode::pt, 60), {}, RenderRank::interactive, sink);
  RenderLoop::Update update = view_of(1, 0);
  update.budget = Budget{};  // without an end
  const std::uint64_t first = loop.update(update);
  ASSERT_TRUE(sink->wait([&] { return sink->begins.size() == 2; }));  // its preview, its film
  ASSERT_TRUE(film_ended(loop.update(view_of(2, 1))));
  ASSERT_TRUE(sink->wait([&] { return sink->ends.size() == 4; }));
  EXPECT_EQ(sink->ends[1].tag.revision, first);
  EXPECT_EQ(sink->ends[1].reason, FrameEndReason::superseded);
  EXPECT_EQ(sink->ends[2].reason, FrameEndReason::preview);
  EXPECT_EQ(sink->ends[3].reason, FrameEndReason::samples);
}

// One worker, which delivers the end of the film that was ended and then has nothing to do for a while.
TEST_F(PreviewFrame, AWorkerWakesWhenTheNextFrameIsDue) {
  RenderEngine one(1);
  RenderLoop loop(one, room, settings_of(RenderMode::pt, 2), {}, RenderRank::interactive, sink);
  for (std::uint64_t id = 1; id <= 3; ++id) {
    RenderLoop::Update update = view_of(id, double(id));
    update.budget = Budget{};
    const std::uint64_t revision = loop.update(update);
    ASSERT_TRUE(sink->wait([&] {
      return !sink->begins.empty() && !sink->begins.back().preview && sink->begins.back().tag.revision == revision;
    }));
  }
}

TEST_F(PreviewFrame, WithoutASceneThereAreNone) {
  FakeIntegrator integrator;
  RenderLoop loop(engine, integrator.function(), settings_of(RenderMode::pt, 60), {}, RenderRank::interactive, sink);
  ASSERT_TRUE(film_ended(loop.update(view_of(1, 0))));
  RenderLoop::Update update = view_of(2, 1);
  update.settings = settings_of(RenderMode::pt, 30);
  update.settings->width += 16;
  EXPECT_TRUE(loop.previews_suit(*update.settings));
  ASSERT_TRUE(film_ended(loop.update(update)));
  EXPECT_EQ(frames_of(*sink).size(), 2u);
}

TEST_F(PreviewFrame, MemoryIsTakenOnlyWhileTheyAreAskedFor) {
  RenderLoop loop(engine, room, settings_of(RenderMode::pt, 0), {}, RenderRank::interactive, sink);
  const std::size_t without = loop.memory_bytes();
  RenderLoop::Update update;
  update.settings = settings_of(RenderMode::pt, 30);
  EXPECT_FALSE(loop.previews_suit(*update.settings));
  loop.update(update);
  EXPECT_TRUE(loop.previews_suit(*update.settings));
  EXPECT_EQ(loop.memory_bytes(), without + PreviewHistory(kWidth, kHeight).bytes());
  EXPECT_LE(PreviewHistory::bytes_per_pixel(), 64u);
  update.settings->preview.rate = 0;
  loop.update(update);
  EXPECT_EQ(loop.memory_bytes(), without);
  // Also in the middle of one; what counts them is released.
  update = view_of(1, 0);
  update.settings = settings_of(RenderMode::pt, 30);
  auto count = std::make_shared<int>(0);
  const std::weak_ptr<int> counted = count;
  update.previews = make_preview_history(*update.settings, std::move(count));
  loop.update(update);
  update = {};
  ASSERT_TRUE(sink->wait([&] { return !sink->begins.empty(); }));
  update.settings = settings_of(RenderMode::pt, 0);
  ASSERT_TRUE(film_ended(loop.update(update)));
  while (!counted.expired()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

TEST_F(PreviewFrame, CancelDropsTilesThatWait) {
  for (const int tile_size : {32, 96}) {
    sink = std::make_shared<RecordingSink>();
    std::atomic<bool> held = false, cancelled = false;
    sink->on_tile = [&](const FrameTile&) {
      held = true;
      while (!cancelled) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    };
    RenderLoopOptions options;
    options.tile_size = tile_size;
    RenderLoop loop(engine, room, settings_of(RenderMode::pt, 60), {}, RenderRank::interactive, sink, options);
    loop.update(view_of(1, 0));
    while (!held) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(10));  // so that, with two tiles, the frame has ended
    loop.cancel();
    cancelled = true;
    ASSERT_TRUE(sink->wait([&] { return !sink->ends.empty(); }));
    EXPECT_EQ(sink->ends[0].reason, FrameEndReason::cancelled);
    EXPECT_EQ(sink->tiles.size(), 1u);
  }
}

// Tells another sink, without failing allocations.
struct ExemptSink final : FrameSink {
  explicit ExemptSink(std::shared_ptr<RecordingSink> sink) : to(std::move(sink)) {}
  void frame_begun(const FrameBegin& begin) override {
    const ExemptFromFailing exempt;
    to->frame_begun(begin);
  }
  void tile_ready(FrameTile tile) override {
    const ExemptFromFailing exempt;
    to->tile_ready(std::move(tile));
  }
  void frame_ended(const FrameEnd& end) override {
    const ExemptFromFailing exempt;
    to->frame_ended(end);
  }
  std::shared_ptr<RecordingSink> to;
};

TEST_F(PreviewFrame, MemoryThatIsOutFailsThePreviewAlone) {
  const ExemptFromFailing exempt;
  RenderLoop loop(engine, room, settings_of(RenderMode::combined, 120), {}, RenderRank::interactive,
                  std::make_shared<ExemptSink>(sink));
  sink->keep_pixels = true;
  ASSERT_TRUE(film_ended(loop.update(view_of(1, 0))));
  std::uint64_t first = 1, id = 1, failed = 0;
  for (bool thrown = true; thrown && first < 100000; first += 1 + first / 4) {
    const FailingAllocations failing(first);
    ++id;
    const std::uint64_t revision = loop.update(view_of(id, 0.1 * double(id)));
    FrameEnd end;
    ASSERT_TRUE(sink->wait([&] {
      const auto of_view = std::find_if(sink->ends.begin(), sink->ends.end(),
                                        [&](const FrameEnd& e) { return e.tag.revision == revision; });
      if (of_view != sink->ends.end()) end = *of_view;
      return of_view != sink->ends.end();
    }));
    thrown = failing.thrown() > 0;
    failed += end.reason == FrameEndReason::failed;
    EXPECT_EQ(end.message, end.reason == FrameEndReason::failed ? "out of memory" : "") << first;
  }
  EXPECT_GE(failed, 5u);
  ASSERT_TRUE(film_ended(loop.update(view_of(++id, 1))));
  const FrameEnd& end = sink->ends.back();
  EXPECT_EQ(end.reason, FrameEndReason::samples);
  // The film of the first view has outlived all of them, if no other began because this thread was held up.
  const auto films = std::count_if(sink->begins.begin(), sink->begins.end(), [](const auto& b) { return !b.preview; });
  EXPECT_TRUE(films > 2 || end.progress.reuse_share > 0.2) << end.progress.reuse_share;
}

// Both move on whenever they have shown a preview; by processor time.
TEST_F(PreviewFrame, TwoThatMoveShareEvenly) {
  struct Mover final : FrameSink {
    void frame_begun(const FrameBegin&) override {}
    void tile_ready(FrameTile) override {}
    void frame_ended(const FrameEnd& end) override {
      if (end.reason == FrameEndReason::preview) ++shown;
    }
    std::atomic<int> shown = 0;
  };
  RenderSettings settings = settings_of(RenderMode::combined, 120);
  settings.width = 320;
  settings.height = 192;
  settings.preview.budget_s = 0.02;
  std::vector<std::shared_ptr<Mover>> movers;
  std::vector<std::unique_ptr<RenderLoop>> loops;
  for (int i = 0; i < 2; ++i) {
    movers.push_back(std::make_shared<Mover>());
    loops.push_back(
        std::make_unique<RenderLoop>(engine, mixed, settings, Budget{}, RenderRank::interactive, movers.back()));
  }
  std::uint64_t id = 0;
  const auto used = [&](std::size_t i) { return loops[i]->used_seconds(); };
  double before[2] = {0, 0};
  const auto move_until = [&](double seconds) {
    for (const double enough = used(0) + used(1) + seconds; used(0) + used(1) < enough;) {
      ++id;
      for (auto& loop : loops) loop->update(view_of(id, 0.05 * double(id % 200)));
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  };
  move_until(0.1);
  for (std::size_t i = 0; i < 2; ++i) before[i] = used(i);
  move_until(0.8);
  const double share = (used(0) - before[0]) / (used(0) + used(1) - before[0] - before[1]);
  EXPECT_GT(share, 0.45);
  EXPECT_LT(share, 0.55);
  for (const auto& mover : movers) EXPECT_GT(mover->shown, 3);
}

}  // namespace
}  // namespace helio::test
