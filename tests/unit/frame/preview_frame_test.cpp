// Previews through the render loop: frames of their own beside a film that does not know of them.
#include <gtest/gtest.h>

#include <map>
#include <stdexcept>
#include <thread>

#include "recording_sink.h"
#include "renderer/frame/render_loop.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 160, kHeight = 96;

RenderSettings settings_of(RenderMode mode, double rate) {
  RenderSettings settings;
  settings.width = kWidth;
  settings.height = kHeight;
  settings.mode = mode;
  settings.seed = 5;
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
    }
    ++number;
  }
}

TEST_F(PreviewFrame, FilmsHaveTheSameBitsWithAndWithoutPreviews) {
  for (const RenderMode mode : kEveryRenderMode) {
    std::vector<ViewPicture> pictures;
    for (const double rate : {0.0, 100.0}) {
      LoopViews views(engine, mixed, settings_of(mode, rate));
      for (const double degrees : {3.0, 2.0, 0.5}) views.render(home(degrees), 8);
      pictures.push_back(views.render(home(), 16));
    }
    EXPECT_TRUE(same_pixels(pictures[0], pictures[1])) << to_string(mode);
  }
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

}  // namespace
}  // namespace helio::test
