// The loop with the path tracer behind it: same bits whatever the course of the frame, and a cancel that comes in time
// even where one path lasts thousands of segments.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <span>
#include <thread>

#include "latency.h"
#include "recording_sink.h"
#include "renderer/frame/render_loop.h"
#include "renderer/trace/scene/edit_scene.h"
#include "tests/support/test_scenes.h"

namespace helio {
namespace {

constexpr int kWidth = 100, kHeight = 70;
constexpr std::uint32_t kSamplesPerHalf = 8;

// A room with a lamp, a mirror-like box and a glass sphere.
SceneDescription room() {
  SceneDescription scene;
  Material metal;
  metal.metallic = 1;
  metal.roughness = 0.2f;
  scene.materials = {test::lambert(Rgb(0.7f, 0.6f, 0.5f)), test::lambert(Rgb(0, 0, 0), Rgb(9, 8, 7)), metal,
                     test::glass(1.5f)};
  test::add_mesh(scene, test::box({-1, -1, -1}, {1, 1, 1}, 0, true));
  test::add_mesh(scene, test::box({-0.6f, -1, -0.5f}, {0, -0.3f, 0.1f}, 2));
  test::add_mesh(scene, test::quad({-0.3f, 0.99f, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f}, 1));
  test::add_sphere(scene, {0.45f, -0.65f, 0.2f}, 0.35f, 3);
  return scene;
}

const CameraPose kPose = test::camera_at({0, 0, 0.95}, {0, -0.2, -1}, 75);

RenderLoop::Update view_of(const CameraPose& pose) {
  RenderLoop::Update update;
  update.view = View{1, pose, 0, 0};
  return update;
}

Budget samples(std::uint32_t n) {
  Budget budget;
  budget.samples = n;
  return budget;
}

// path_tracer(), and where the loop's film lies.
struct WatchedTracer {
  std::shared_ptr<std::atomic<Film*>> film = std::make_shared<std::atomic<Film*>>(nullptr);

  IntegrateFunction function(const std::shared_ptr<const RenderScene>& scene) const {
    return [trace = path_tracer(scene), seen = film](const IntegrateJob& job, const CancelToken& cancel, Film& pixels,
                                                     TraceStats& stats) {
      *seen = &pixels;
      return trace(job, cancel, pixels, stats);
    };
  }
};

RenderSettings settings_of(const PathSettings& path) {
  RenderSettings settings;
  settings.width = kWidth;
  settings.height = kHeight;
  settings.max_segments = path.max_segments;
  settings.roulette_from = path.roulette_from;
  settings.seed = path.seed;
  return settings;
}

TEST(TracedFrame, ThreadsTilesAndPassesDoNotChangeABit) {
  const auto scene = test::build(room());
  PathSettings path;
  path.seed = 12;
  path.max_segments = 6;
  const Film expected = test::render(*scene, kPose, kWidth, kHeight, kSamplesPerHalf, path);
  for (const int threads : {1, 2, 4}) {
    RenderEngine engine(threads);
    for (const int tile_size : {128, 24}) {
      for (const RenderRank rank : {RenderRank::interactive, RenderRank::job}) {
        const auto sink = std::make_shared<RecordingSink>();
        const WatchedTracer tracer;
        RenderLoopOptions options;
        options.tile_size = tile_size;
        RenderLoop loop(engine, tracer.function(scene), settings_of(path), samples(2 * kSamplesPerHalf), rank, sink,
                        options);
        ASSERT_TRUE(sink->wait_for_end(loop.update(view_of(kPose))));
        EXPECT_TRUE(test::same_bits(expected, **tracer.film)) << threads << " threads, tiles of " << tile_size;
      }
    }
  }
}

TEST(TracedFrame, TheSettingsFilterIsTheCameras) {
  const auto scene = test::build(room());
  RenderSettings settings = settings_of({});
  settings.filter = {PixelFilterKind::tent, 1.5};
  const Film expected = test::render(*scene, kPose, kWidth, kHeight, kSamplesPerHalf, {}, nullptr, settings.filter);
  RenderEngine engine(2);
  const auto sink = std::make_shared<RecordingSink>();
  const WatchedTracer tracer;
  RenderLoop loop(engine, tracer.function(scene), settings, samples(2 * kSamplesPerHalf), RenderRank::job, sink);
  ASSERT_TRUE(sink->wait_for_end(loop.update(view_of(kPose))));
  EXPECT_TRUE(test::same_bits(expected, **tracer.film));
  EXPECT_FALSE(test::same_bits(expected, test::render(*scene, kPose, kWidth, kHeight, kSamplesPerHalf)));
}

TEST(TracedFrame, InterruptionsDoNotChangeABit) {
  const auto scene = test::build(room());
  const Film expected = test::render(*scene, kPose, kWidth, kHeight, kSamplesPerHalf);
  RenderEngine engine(2);
  const auto sink = std::make_shared<RecordingSink>();
  const WatchedTracer tracer;
  RenderLoop loop(engine, tracer.function(scene), settings_of({}), samples(2 * kSamplesPerHalf),
                  RenderRank::interactive, sink);
  loop.update(view_of(test::camera_at({0.3, 0, 0.9}, {0, 0, -1}, 50)));  // leaves its samples behind in the film
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  loop.update(view_of(kPose));
  std::uint64_t revision = 0;
  for (int i = 0; i < 10; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    if (i % 3 == 0) loop.cancel();
    Budget budget = samples(2 * kSamplesPerHalf);
    if (i < 9) budget.time_s = 0.003;
    RenderLoop::Update update;
    update.budget = budget;
    revision = loop.update(update);
  }
  const auto end = sink->wait_for_end(revision);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->reason, FrameEndReason::samples);
  EXPECT_TRUE(test::same_bits(expected, **tracer.film));
}

// Back where it began after a thousand tiny moves, and after zooming in by a hundred, the picture is that of a loop that
// never moved: no ghost, no drift.
TEST(TracedFrame, AThousandTinyMovesAndAZoomLeaveNoTrace) {
  const auto scene = test::build(room());
  const Film expected = test::render(*scene, kPose, kWidth, kHeight, kSamplesPerHalf);
  RenderEngine engine(2);
  const auto sink = std::make_shared<RecordingSink>();
  const WatchedTracer tracer;
  RenderLoop loop(engine, tracer.function(scene), settings_of({}), samples(2 * kSamplesPerHalf),
                  RenderRank::interactive, sink);
  ASSERT_TRUE(sink->wait_for_end(loop.update(view_of(kPose))));
  std::uint64_t id = 1;
  const auto look_from = [&](const CameraPose& pose) {
    RenderLoop::Update update;
    update.view = View{++id, pose, 0, 0};
    return loop.update(update);
  };
  for (int i = 1; i <= 1000; ++i) {
    CameraPose pose = kPose;
    pose.position.x += 1e-5 * (i <= 500 ? i : 1000 - i);
    const std::uint64_t revision = look_from(pose);
    if (i % 100 == 50) {  // the others are superseded at any point
      ASSERT_TRUE(sink->wait_for_end(revision)) << i;
    }
  }
  ASSERT_TRUE(sink->wait_for_end(loop.revision()));
  EXPECT_TRUE(test::same_bits(expected, **tracer.film));
  CameraPose zoomed = kPose;
  zoomed.vertical_fov /= 100;
  ASSERT_TRUE(sink->wait_for_end(look_from(zoomed)));
  EXPECT_FALSE(test::same_bits(expected, **tracer.film));
  ASSERT_TRUE(sink->wait_for_end(look_from(kPose)));
  EXPECT_TRUE(test::same_bits(expected, **tracer.film));
}

TEST(TracedFrame, ARegionHasTheBitsOfTheWholeFrame) {
  const auto scene = test::build(room());
  const Film expected = test::render(*scene, kPose, kWidth, kHeight, kSamplesPerHalf);
  RenderEngine engine(2);
  const auto sink = std::make_shared<RecordingSink>();
  sink->keep_pixels = true;
  RenderSettings settings = settings_of({});
  settings.region = PixelRect{13, 22, 71, 59};
  RenderLoopOptions options;
  options.publish_passes = false;
  RenderLoop loop(engine, scene, settings, samples(2 * kSamplesPerHalf), RenderRank::interactive, sink, options);
  ASSERT_TRUE(sink->wait_for_end(loop.update(view_of(kPose))));
  ASSERT_EQ(sink->pixels.size(), 1u);
  const ResolvedTile whole = resolve_tile(expected, *settings.region, *settings.region, kResolveVariance);
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(sink->pixels[0].radiance[c], whole.radiance[c]);
    EXPECT_EQ(sink->pixels[0].variance[c], whole.variance[c]);
  }
  const FilmError error = estimate_error(expected, *settings.region);
  EXPECT_EQ(sink->ends[0].progress.error.rmse, error.rmse);
  EXPECT_EQ(sink->ends[0].progress.error.relmse, error.relmse);
  EXPECT_GT(sink->ends[0].progress.trace.rays, sink->ends[0].progress.trace.paths);
}

// Of the frame of this revision, tile by tile as it came.
std::vector<std::vector<float>> green_of(RecordingSink& sink, std::uint64_t revision) {
  return sink.read([&] {
    std::vector<std::pair<int, std::vector<float>>> tiles;
    for (std::size_t i = 0; i < sink.tiles.size(); ++i) {
      const RecordingSink::TileRecord& tile = sink.tiles[i];
      if (tile.tag.revision != revision || !tile.final) continue;
      tiles.emplace_back(tile.window.y0 * kWidth + tile.window.x0, sink.pixels[i].radiance[1]);
    }
    std::sort(tiles.begin(), tiles.end());
    std::vector<std::vector<float>> pixels;
    for (auto& [place, green] : tiles) pixels.push_back(std::move(green));
    return pixels;
  });
}

// In the middle of a frame and after its end; nothing of the old scene's samples is left in the film.
TEST(TracedFrame, AnotherSceneStartsOver) {
  const auto before = test::build(room());
  const SceneEdit brighter = MaterialEdit{1u, std::nullopt, Rgb(2, 20, 2), std::nullopt};
  const auto after = *edit_scene(before, *resolve_edits(before->description(), std::span(&brighter, 1)));
  RenderEngine engine(2);
  const auto render_one = [&](const std::shared_ptr<const RenderScene>& scene) {
    const auto sink = std::make_shared<RecordingSink>();
    sink->keep_pixels = true;
    RenderLoop loop(engine, scene, settings_of({}), samples(8), RenderRank::interactive, sink);
    const std::uint64_t revision = loop.update(view_of(kPose));
    EXPECT_TRUE(sink->wait_for_end(revision));
    return green_of(*sink, revision);
  };
  const auto old_picture = render_one(before), new_picture = render_one(after);
  ASSERT_NE(old_picture, new_picture);

  const auto sink = std::make_shared<RecordingSink>();
  sink->keep_pixels = true;
  RenderLoop loop(engine, before, settings_of({}), {}, RenderRank::interactive, sink);
  const std::uint64_t endless = loop.update(view_of(kPose));
  ASSERT_TRUE(sink->wait([&] { return !sink->tiles.empty(); }));
  RenderLoop::Update update;
  update.scene = after;
  update.budget = samples(8);
  const std::uint64_t revision = loop.update(update);
  ASSERT_TRUE(sink->wait_for_end(revision));
  EXPECT_EQ(sink->wait_for_end(endless)->reason, FrameEndReason::superseded);
  EXPECT_EQ(green_of(*sink, revision), new_picture);
  EXPECT_EQ(sink->read([&] { return sink->begins.back().scene.lock(); }), after);
  RenderLoop::Update back;
  back.scene = before;
  const std::uint64_t last = loop.update(back);
  ASSERT_TRUE(sink->wait_for_end(last));
  EXPECT_EQ(green_of(*sink, last), old_picture);
  // The same scene again changes nothing: the film is kept, and its frame ends at once.
  const std::uint64_t same = loop.update(back);
  ASSERT_TRUE(sink->wait_for_end(same));
  EXPECT_EQ(green_of(*sink, same), old_picture);
  EXPECT_EQ(sink->wait_for_end(same)->progress.trace.paths, std::uint64_t(kWidth) * kHeight * 8);
}

TEST(TracedFrame, EndlessPathsAreCancelledInTime) {
  SceneDescription furnace;  // closed, and nothing is ever absorbed
  furnace.materials = {test::lambert(Rgb(1, 1, 1), Rgb(1, 1, 1))};
  test::add_mesh(furnace, test::box({-1, -1, -1}, {1, 1, 1}, 0, true));
  RenderSettings settings = settings_of({});
  settings.max_segments = settings.roulette_from = 65535;
  RenderEngine engine(2);
  const auto sink = std::make_shared<RecordingSink>();
  RenderLoop loop(engine, test::build(std::move(furnace)), settings, {}, RenderRank::interactive, sink);
  std::vector<double> delays;
  for (int i = 0; i < 10; ++i) {
    const std::uint64_t revision = loop.update(view_of(kPose));
    ASSERT_TRUE(sink->wait([&] { return !sink->begins.empty() && sink->begins.back().tag.revision == revision; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    const double asked = process_cpu_s();
    loop.cancel();
    ASSERT_TRUE(sink->wait_for_end(revision));
    delays.push_back(sink->read([&] { return sink->end_cpu.back(); }) - asked);
  }
  EXPECT_LT(percentile_90(delays), allowed_work_s(2));
}

}  // namespace
}  // namespace helio
