// Frames to which light paths bring splats: pictures do not depend on who was first, start over as a whole, and are not
// shown while any of their light paths may still land.
#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <thread>

#include "fake_integrator.h"
#include "recording_sink.h"
#include "renderer/film/splats/splat_buffer.h"
#include "renderer/frame/render_loop.h"

namespace helio {
namespace {

constexpr int kWidth = 150, kHeight = 100;

// Every sample has a light path, which lands on some pixel of the film, with exponential noise; both depend on the
// sample and on where the camera stands. Its mean is 1 a pixel.
struct SplattingIntegrator {
  FakeIntegrator camera;

  IntegrateFunction function() const {
    return [self = *this](const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) {
      return self.run(job, cancel, film, stats);
    };
  }

  bool run(const IntegrateJob& job, const CancelToken& cancel, Film& film, TraceStats& stats) const {
    if (!film.splats()) return camera.run(job, cancel, film, stats);
    const std::uint64_t seed = job.settings.seed + 1000 + std::uint64_t(job.camera.position.x);
    const SampleRange& range = job.range;
    std::vector<Splat> splats;
    for (int y = job.window.y0; y < job.window.y1; ++y) {
      for (int x = job.window.x0; x < job.window.x1; ++x) {
        for (std::uint32_t index = range.first; index < range.first + range.count; ++index) {
          if (job.targets && !job.targets->wants(film, range.half, x, y, index)) continue;
          const auto random = [&](std::uint64_t i) { return hash_sample(8 * seed + i, x, y, range.half, index); };
          const auto at_x = std::int32_t(random(0) * float(film.width()));
          const auto at_y = std::int32_t(random(1) * float(film.height()));
          const float pixels = float(film.width() * film.height());
          splats.push_back({at_x, at_y, Rgb(-std::log(1 - random(2)) * pixels)});
        }
      }
    }
    if (!camera.run(job, cancel, film, stats)) return false;
    film.splats()->add(range.half, splats, splats.size());
    stats.light_paths += splats.size();
    return true;
  }
};

using Picture = std::map<std::pair<int, int>, ResolvedTile>;  // final tiles by corner

class SplatFrame : public ::testing::Test {
 protected:
  static RenderSettings settings_of(RenderMode mode, Integrator integrator = Integrator::bdpt) {
    RenderSettings settings = film_of(kWidth, kHeight);
    settings.mode = mode;
    settings.integrator = integrator;
    return settings;
  }
  static Budget samples(std::uint32_t n) {
    Budget budget;
    budget.samples = n;
    return budget;
  }
  static RenderLoop::Update view_update(std::uint64_t id, double x) {
    RenderLoop::Update update;
    update.view = view_at(id, x);
    return update;
  }

  void make(const RenderSettings& settings, const Budget& budget, int threads = 2, int tile_size = 0) {
    loop.reset();
    engine = std::make_unique<RenderEngine>(threads);
    sink = std::make_shared<RecordingSink>();
    sink->keep_pixels = true;
    RenderLoopOptions options;
    if (tile_size > 0) options.tile_size = tile_size;
    loop = std::make_unique<RenderLoop>(*engine, integrator.function(), settings, budget, RenderRank::interactive, sink,
                                        options);
  }
  // The final tiles of a frame that ends.
  Picture finish(const RenderLoop::Update& update) {
    const auto end = sink->wait_for_end(loop->update(update));
    EXPECT_TRUE(end.has_value());
    if (end) last = *end;
    Picture picture;
    for (std::size_t i = 0; i < sink->tiles.size(); ++i) {
      if (!sink->tiles[i].final || !end || sink->tiles[i].tag.frame != end->tag.frame) continue;
      picture[{sink->tiles[i].window.x0, sink->tiles[i].window.y0}] = sink->pixels[i];
    }
    return picture;
  }
  static void expect_same(const Picture& a, const Picture& b) {
    ASSERT_FALSE(a.empty());
    ASSERT_EQ(a.size(), b.size());
    for (const auto& [corner, tile] : a) {
      const ResolvedTile& other = b.at(corner);
      EXPECT_EQ(tile.radiance[0], other.radiance[0]) << corner.first << "," << corner.second;
      EXPECT_EQ(tile.variance[0], other.variance[0]) << corner.first << "," << corner.second;
    }
  }

  SplattingIntegrator integrator;
  std::unique_ptr<RenderEngine> engine;
  std::shared_ptr<RecordingSink> sink;
  std::unique_ptr<RenderLoop> loop;
  FrameEnd last;
};

TEST_F(SplatFrame, BitsDoNotDependOnThreads) {
  for (const RenderMode mode : {RenderMode::pt, RenderMode::adaptive}) {
    integrator.camera.noisy_from = 0.5f;
    make(settings_of(mode), samples(32), 1);
    const Picture alone = finish(view_update(1, 0));
    EXPECT_EQ(last.progress.trace.light_paths, last.progress.trace.paths);
    make(settings_of(mode), samples(32), 5);
    expect_same(finish(view_update(1, 0)), alone);
  }
  double sum = 0;
  for (const auto& [corner, tile] : finish(view_update(2, 0)))
    sum = std::accumulate(tile.radiance[0].begin(), tile.radiance[0].end(), sum);
  EXPECT_NEAR(sum / (kWidth * kHeight), 1.5, 0.01) << "half from the camera, 1 from the lights; deviation about 0.002";
}

// Whatever part of the picture is shown, all light paths of its samples have landed.
TEST_F(SplatFrame, NothingIsShownBeforeEveryLightPathHasLanded) {
  for (const std::uint32_t n : {1u, 8u}) {
    make(settings_of(RenderMode::pt), samples(n), 4, 32);
    std::atomic<std::uint64_t> before = integrator.camera.counters->samples.load(), early = 0, shown = 0;
    sink->on_tile = [&](const FrameTile& tile) {
      ++shown;
      early += integrator.camera.counters->samples - before < std::uint64_t(tile.samples_per_pixel) * kWidth * kHeight;
    };
    finish(view_update(1, 0));
    EXPECT_GE(shown, 20u);
    EXPECT_EQ(early, 0u);
    loop.reset();
  }
}

TEST_F(SplatFrame, AMoveStartsTheSplatsOver) {
  make(settings_of(RenderMode::pt), samples(4));
  const Picture fresh = finish(view_update(1, 7));
  make(settings_of(RenderMode::pt), samples(4));
  const Picture before = finish(view_update(1, 3));
  EXPECT_NE(before.begin()->second.radiance[0], fresh.begin()->second.radiance[0]);
  expect_same(finish(view_update(2, 7)), fresh);
  EXPECT_EQ(last.progress.trace.light_paths, 4u * kWidth * kHeight);
}

TEST_F(SplatFrame, AnotherIntegratorStartsTheFilmOver) {
  make(settings_of(RenderMode::pt, Integrator::path), samples(4));
  const Picture path = finish(view_update(1, 0));
  EXPECT_EQ(last.progress.trace.light_paths, 0u);
  const std::size_t bytes = loop->memory_bytes();
  RenderLoop::Update update;
  update.settings = settings_of(RenderMode::pt);
  const Picture bdpt = finish(update);
  EXPECT_EQ(last.progress.trace.light_paths, 4u * kWidth * kHeight);
  EXPECT_GE(loop->memory_bytes(), bytes + SplatBuffer::kBytesPerPixel * kWidth * kHeight);
  EXPECT_NE(bdpt.begin()->second.radiance[0], path.begin()->second.radiance[0]);
  update.settings = settings_of(RenderMode::pt, Integrator::light);
  finish(update);
  EXPECT_EQ(last.progress.trace.light_paths, 4u * kWidth * kHeight) << "films alike, yet begun anew";
  update.settings = settings_of(RenderMode::pt, Integrator::path);
  expect_same(finish(update), path);
  EXPECT_EQ(last.progress.trace.light_paths, 0u);
}

// Pieces that a move or a budget interrupts leave neither samples nor splats.
TEST_F(SplatFrame, InterruptionsLeaveNothingBehind) {
  make(settings_of(RenderMode::pt), samples(4));
  const Picture fresh = finish(view_update(1, 9));
  integrator.camera.seconds_per_sample = 2e-6;
  make(settings_of(RenderMode::pt), samples(4), 3);
  for (std::uint64_t id = 1; id <= 6; ++id) {
    loop->update(view_update(id, double(id)));
    std::this_thread::sleep_for(std::chrono::milliseconds(7 * id));
  }
  loop->update(view_update(7, 9));
  for (int i = 0; i < 4; ++i) {  // the film is kept
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    RenderLoop::Update update;
    update.budget = samples(4);
    loop->update(update);
  }
  RenderLoop::Update update;
  update.budget = samples(4);
  expect_same(finish(update), fresh);
  EXPECT_EQ(integrator.camera.counters->out_of_order, 0u);
}

}  // namespace
}  // namespace helio
