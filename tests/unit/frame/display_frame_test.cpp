// The display layer through the render loop: with every tile that asks for it, beside a film that does not know of it.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "recording_sink.h"
#include "renderer/film/display/display_layer.h"
#include "renderer/frame/render_loop.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 160, kHeight = 96;
constexpr unsigned kPlain = kResolveVariance | kResolveSamples, kWithDisplay = kPlain | kResolveDisplay;

RenderSettings settings_of(RenderMode mode) {
  return loop_settings(kWidth, kHeight, mode);
}

CameraPose home() {
  return camera_at({0.1, 0.1, 0.9}, {0, -0.2, -1}, 60);
}

RenderLoop::Update view_of(std::uint64_t id, std::uint32_t samples) {
  RenderLoop::Update update;
  update.view = View{id, home()};
  update.budget = Budget{};
  update.budget->samples = samples;
  return update;
}

bool filtered(const ResolvedTile& tile) {
  return tile.display[0] != tile.radiance[0];
}

double seconds_of(const FrameEnd& end, const char* pass) {
  for (const PassTime& time : end.passes) {
    if (time.pass == pass) return time.seconds;
  }
  return 0;
}

class DisplayFrame : public testing::Test {
 protected:
  RenderEngine engine{2};
  std::shared_ptr<const RenderScene> room = build(lambert_room()), mixed = build(mixed_scene());
  std::shared_ptr<RecordingSink> sink = std::make_shared<RecordingSink>();

  RenderLoopOptions options(unsigned channels) {
    RenderLoopOptions options;
    options.channels = channels;
    sink->keep_pixels = true;
    sink->with_display = (channels & kResolveDisplay) != 0;
    return options;
  }
};

TEST_F(DisplayFrame, IsTheFilmAtFirstAndFilteredOnceBothHalvesHaveSamples) {
  RenderLoop loop(engine, room, settings_of(RenderMode::pt), {}, RenderRank::interactive, sink, options(kWithDisplay));
  const auto end = sink->wait_for_end(loop.update(view_of(1, 16)));
  ASSERT_TRUE(end);
  EXPECT_GT(seconds_of(*end, "display"), 0);
  bool first = false, later = true;
  for (std::size_t i = 0; i < sink->tiles.size(); ++i) {
    if (sink->tiles[i].pass == 0) first |= filtered(sink->pixels[i]);
    if (sink->tiles[i].pass > 0) later &= filtered(sink->pixels[i]);
    EXPECT_EQ(sink->pixels[i].display_error.size(), std::size_t(sink->pixels[i].window.area()));
  }
  EXPECT_FALSE(first);
  EXPECT_TRUE(later);
}

TEST_F(DisplayFrame, FilmsHaveTheSameBitsWithAndWithoutIt) {
  for (const RenderMode mode : kEveryRenderMode) {
    std::vector<ViewPicture> pictures;
    for (const unsigned channels : {kPlain, kWithDisplay}) {
      RenderSettings settings = settings_of(mode);
      settings.width = 72;
      settings.height = 48;
      RenderLoopOptions with;
      with.channels = channels;
      LoopViews views(engine, mixed, settings, with);
      views.render(camera_at({0.12, 0.1, 0.9}, {0, -0.2, -1}, 60), 4);
      pictures.push_back(views.render(home(), 8));
    }
    EXPECT_TRUE(same_pixels(pictures[0], pictures[1])) << to_string(mode);
  }
}

TEST_F(DisplayFrame, MayBeAskedForAtRestAndGivenUpAgain) {
  RenderLoop loop(engine, room, settings_of(RenderMode::pt), {}, RenderRank::interactive, sink, options(kPlain));
  ASSERT_TRUE(sink->wait_for_end(loop.update(view_of(1, 8))));
  const std::size_t before = loop.memory_bytes();
  const std::uint64_t samples = loop.progress().trace.paths;

  sink->with_display = true;
  RenderLoop::Update update;
  update.channels = kWithDisplay;
  ASSERT_TRUE(sink->wait_for_end(loop.update(update)));
  EXPECT_EQ(loop.progress().trace.paths, samples);
  EXPECT_TRUE(sink->tiles.back().final && filtered(sink->pixels.back()));
  EXPECT_EQ(loop.memory_bytes() - before, std::size_t(kWidth * kHeight) * DisplayLayer::bytes_per_pixel());
  EXPECT_LE(DisplayLayer::bytes_per_pixel(), 40u);

  sink->with_display = false;
  update.channels = kPlain;
  ASSERT_TRUE(sink->wait_for_end(loop.update(update)));
  EXPECT_EQ(loop.memory_bytes(), before);
}

TEST_F(DisplayFrame, ShowsTheSameAgainWithoutFilteringAgain) {
  RenderLoop loop(engine, room, settings_of(RenderMode::pt), {}, RenderRank::interactive, sink, options(kWithDisplay));
  ASSERT_TRUE(sink->wait_for_end(loop.update(view_of(1, 8))));
  const std::size_t ends = sink->read([&] { return sink->ends.size(); });
  loop.republish();
  ASSERT_TRUE(sink->wait([&] { return sink->ends.size() > ends; }));
  EXPECT_EQ(seconds_of(sink->ends.back(), "display"), 0);
  EXPECT_TRUE(filtered(sink->pixels.back()));
}

TEST_F(DisplayFrame, FiltersAnewWhatIsShownAgainAfterACancel) {
  RenderLoopOptions quiet = options(kWithDisplay);
  quiet.publish_passes = false;
  RenderLoop loop(engine, room, settings_of(RenderMode::pt), {}, RenderRank::interactive, sink, quiet);
  loop.update(view_of(1, 1 << 20));
  for (int tries = 0; tries < 60000 && loop.progress().trace.paths < 4u * kWidth * kHeight; ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  loop.cancel();
  ASSERT_TRUE(sink->wait([&] { return !sink->ends.empty(); }));
  const std::size_t ends = sink->read([&] { return sink->ends.size(); });
  loop.republish();
  ASSERT_TRUE(sink->wait([&] { return sink->ends.size() > ends; }));
  EXPECT_GT(seconds_of(sink->ends.back(), "display"), 0);
  EXPECT_TRUE(filtered(sink->pixels.back()));
}

TEST_F(DisplayFrame, TheLastViewOfADragIsFiltered) {
  RenderLoop loop(engine, room, settings_of(RenderMode::combined), {}, RenderRank::interactive, sink,
                  options(kWithDisplay));
  std::optional<FrameEnd> end;
  for (std::uint64_t id = 1; id <= 6; ++id) {
    RenderLoop::Update update = view_of(id, 8);
    update.view->camera = camera_at({0.1 + 0.02 * double(id), 0.1, 0.9}, {0, -0.2, -1}, 60);
    const std::uint64_t revision = loop.update(update);
    if (id % 2 == 0) end = sink->wait_for_end(revision);  // others are overtaken
  }
  ASSERT_TRUE(end);
  EXPECT_EQ(end->reason, FrameEndReason::samples);
  EXPECT_GT(seconds_of(*end, "display"), 0);
  EXPECT_TRUE(filtered(sink->pixels.back()));
}

TEST_F(DisplayFrame, FollowsSizeRegionAndEveryMode) {
  RenderLoop loop(engine, mixed, settings_of(RenderMode::pt), {}, RenderRank::interactive, sink, options(kWithDisplay));
  std::uint64_t id = 0;
  for (const RenderMode mode : kEveryRenderMode) {
    for (const int width : {90, 161}) {
      RenderLoop::Update update = view_of(++id, 4);
      update.settings = settings_of(mode);
      update.settings->width = width;
      update.settings->region = PixelRect{5, 7, width - 3, 80};
      const auto end = sink->wait_for_end(loop.update(update));
      ASSERT_TRUE(end);
      EXPECT_EQ(end->reason, FrameEndReason::samples) << end->message;
      EXPECT_TRUE(filtered(sink->pixels.back())) << to_string(mode) << ' ' << width;
    }
  }
}

}  // namespace
}  // namespace helio::test
