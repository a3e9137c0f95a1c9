// The display layer by Open Image Denoise through the render loop: by a fake of the library, whose formula is known.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "recording_sink.h"
#include "renderer/film/display/display_layer.h"
#include "renderer/film/display/oidn_library.h"
#include "renderer/frame/render_loop.h"
#include "tests/support/loop_views.h"
#include "tests/support/oidn.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

constexpr int kWidth = 96, kHeight = 64;
constexpr unsigned kOwn = kResolveVariance | kResolveSamples | kResolveDisplay, kByOidn = kOwn | kDisplayByOidn;

RenderLoop::Update view_of(std::uint64_t id, std::uint32_t samples, double x = 0.1) {
  RenderLoop::Update update;
  update.view = View{id, camera_at({x, 0.1, 0.9}, {0, -0.2, -1}, 60)};
  update.budget = Budget{};
  update.budget->samples = samples;
  return update;
}

double seconds_of(const FrameEnd& end, const char* pass) {
  for (const PassTime& time : end.passes) {
    if (time.pass == pass) return time.seconds;
  }
  return 0;
}

bool is_film(const ResolvedTile& tile) {
  return tile.display[0] == tile.radiance[0] && tile.display[2] == tile.radiance[2];
}
// By the formula of the fake, the display is within these bounds of the film.
bool is_by_fake(const ResolvedTile& tile) {
  for (std::size_t i = 0; i < tile.radiance[1].size(); ++i) {
    const float added = tile.display[1][i] - tile.radiance[1][i] / 2;
    if (!(added >= -1e-5f && added <= 0.376f) || !std::isinf(tile.display_error[i])) return false;
  }
  return !is_film(tile);
}

class OidnFrame : public testing::Test {
 protected:
  RenderEngine engine{2};
  std::shared_ptr<const RenderScene> room = build(lambert_room());
  std::shared_ptr<RecordingSink> sink = std::make_shared<RecordingSink>();
  RenderSettings settings = loop_settings(kWidth, kHeight, RenderMode::pt);

  RenderLoopOptions options(unsigned channels, bool library = true) {
    RenderLoopOptions options;
    options.channels = channels;
    if (library) options.oidn = OidnLibrary::load(HELIO_FAKE_OIDN, 1).value();
    sink->keep_pixels = sink->with_display = true;
    return options;
  }
};

TEST_F(OidnFrame, MakesTheLayerOfTheWholePictureAndOfARegion) {
  RenderLoop loop(engine, room, settings, {}, RenderRank::interactive, sink, options(kByOidn));
  std::uint64_t id = 0;
  for (const PixelRect& region : {PixelRect{0, 0, kWidth, kHeight}, PixelRect{5, 7, 90, 60}}) {
    RenderLoop::Update update = view_of(++id, 8);
    update.settings = settings;
    update.settings->region = region;
    const auto end = sink->wait_for_end(loop.update(update));
    ASSERT_TRUE(end);
    EXPECT_EQ(end->reason, FrameEndReason::samples) << end->message;
    EXPECT_TRUE(sink->tiles.back().final);
    EXPECT_TRUE(is_by_fake(sink->pixels.back()));
  }
}

TEST_F(OidnFrame, TheFilmHasTheSameBits) {
  std::vector<ViewPicture> pictures;
  for (const unsigned channels : {kOwn, kByOidn}) {
    RenderLoopOptions with = options(channels);
    LoopViews views(engine, room, settings, with);
    views.render(camera_at({0.12, 0.1, 0.9}, {0, -0.2, -1}, 60), 4);
    pictures.push_back(views.render(camera_at({0.1, 0.1, 0.9}, {0, -0.2, -1}, 60), 8));
  }
  EXPECT_TRUE(same_pixels(pictures[0], pictures[1]));
}

TEST_F(OidnFrame, TheDenoiserMayChangeAtRest) {
  RenderLoop loop(engine, room, settings, {}, RenderRank::interactive, sink, options(kOwn));
  ASSERT_TRUE(sink->wait_for_end(loop.update(view_of(1, 8))));
  EXPECT_FALSE(is_by_fake(sink->pixels.back()));
  const std::size_t own = loop.memory_bytes();
  const std::uint64_t paths = loop.progress().trace.paths;
  const std::size_t pixels = kWidth * kHeight;
  for (const unsigned channels : {kByOidn, kOwn, kByOidn}) {
    const bool by_oidn = channels == kByOidn;
    EXPECT_EQ(loop.display_suits(settings, channels), false);
    RenderLoop::Update update;
    update.channels = channels;
    const auto end = sink->wait_for_end(loop.update(update));
    ASSERT_TRUE(end);
    EXPECT_GT(seconds_of(*end, "display"), 0);
    EXPECT_EQ(is_by_fake(sink->pixels.back()), by_oidn);
    EXPECT_FALSE(is_film(sink->pixels.back()));
    const std::size_t more =
        by_oidn ? DisplayLayer::bytes_by_oidn(pixels) - pixels * DisplayLayer::bytes_per_pixel() : 0;
    EXPECT_EQ(loop.memory_bytes(), own + more);
    EXPECT_TRUE(loop.display_suits(settings, channels));
  }
  EXPECT_EQ(loop.progress().trace.paths, paths);
}

TEST_F(OidnFrame, WithoutTheLibraryTheLayerIsOurOwn) {
  RenderLoop loop(engine, room, settings, {}, RenderRank::interactive, sink, options(kByOidn, false));
  ASSERT_TRUE(sink->wait_for_end(loop.update(view_of(1, 8))));
  EXPECT_FALSE(is_by_fake(sink->pixels.back()) || is_film(sink->pixels.back()));
  EXPECT_TRUE(loop.display_suits(settings, kByOidn));
}

TEST_F(OidnFrame, AFailureShowsTheFilmAndIsNotTriedAgainForThatPicture) {
  RenderLoop loop(engine, room, settings, {}, RenderRank::interactive, sink, options(kByOidn));
  {
    const FakeOidnDoes fail("fail");
    const auto end = sink->wait_for_end(loop.update(view_of(1, 8)));
    ASSERT_TRUE(end);
    EXPECT_EQ(end->reason, FrameEndReason::samples) << end->message;
    EXPECT_TRUE(is_film(sink->pixels.back()));
  }
  // More samples for the same picture, though the library would work by now.
  auto end = sink->wait_for_end(loop.update(view_of(2, 16)));
  ASSERT_TRUE(end);
  EXPECT_EQ(seconds_of(*end, "display"), 0);
  EXPECT_TRUE(is_film(sink->pixels.back()));
  end = sink->wait_for_end(loop.update(view_of(3, 8, 0.2)));
  ASSERT_TRUE(end);
  EXPECT_TRUE(is_by_fake(sink->pixels.back()));
}

TEST_F(OidnFrame, ANewViewDoesNotWaitForTheDenoiser) {
  RenderLoopOptions quiet = options(kByOidn);
  quiet.publish_passes = false;
  RenderLoop loop(engine, room, settings, {}, RenderRank::interactive, sink, quiet);
  {
    const FakeOidnDoes slow("slow");
    loop.update(view_of(1, 4));
    for (int tries = 0; tries < 60000 && loop.progress().trace.paths < 4u * kWidth * kHeight; ++tries)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // it denoises
    loop.update(view_of(2, 1 << 20, 0.2));
    const double began = now_s();
    ASSERT_TRUE(sink->wait([&] { return !sink->begins.empty() && sink->begins.back().tag.view_id == 2; }));
    EXPECT_LT(now_s() - began, 5);  // of ten seconds
    loop.cancel();
  }
  ASSERT_TRUE(sink->wait_for_end(loop.update(view_of(3, 4, 0.3))));
  EXPECT_TRUE(is_by_fake(sink->pixels.back()));
}

}  // namespace
}  // namespace helio::test
