// A sample is a function of (pixel, sample index, dimension, seed) and nothing else.
#include <gtest/gtest.h>

#include <thread>

#include "renderer/film/core/sample_targets.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

const CameraPose kPose = camera_at({0.1, 0, 0.95}, {0, -0.2, -1}, 75);

Film render_pieces(const RenderScene& scene, int width, int height, int piece, int shift, std::uint32_t step,
                   int threads) {
  Film film(width, height);
  const Camera camera(kPose, width, height, scene.origin());
  const CancelToken never;
  std::vector<PixelRect> windows;
  for (int y = -shift; y < height; y += piece) {
    for (int x = -shift; x < width; x += piece) {
      const PixelRect w = intersect({x, y, x + piece, y + piece}, film.bounds());
      if (!w.empty()) windows.push_back(w);
    }
  }
  std::vector<std::thread> workers;
  for (int t = 0; t < threads; ++t) {
    workers.emplace_back([&, t] {
      TraceStats stats;
      for (std::size_t i = windows.size(); i-- > 0;) {
        if (int(i) % threads != t) continue;
        for (std::uint32_t s = 0; s < 8; s += step) {
          for (int half = kHalves - 1; half >= 0; --half) {
            ASSERT_TRUE(trace_window(scene, camera, {}, {half, s, step}, windows[i], never, film, stats));
          }
        }
      }
    });
  }
  for (std::thread& worker : workers) worker.join();
  return film;
}

TEST(PathDeterminism, CutsThreadsAndOrderDoNotMatter) {
  for (const bool mixed : {false, true}) {
    const auto scene = build(mixed ? mixed_scene() : lambert_room());
    const int w = 37, h = 26;
    const Film whole = render(*scene, kPose, w, h, 8);
    EXPECT_TRUE(same_bits(whole, render_pieces(*scene, w, h, 64, 0, 8, 1)));
    EXPECT_TRUE(same_bits(whole, render_pieces(*scene, w, h, 16, 0, 1, 2)));
    EXPECT_TRUE(same_bits(whole, render_pieces(*scene, w, h, 7, 3, 2, 4)));
    EXPECT_TRUE(same_bits(whole, render_pieces(*scene, w, h, 1, 0, 4, 2)));
  }
}

// A pixel of a region has the bits that it has in the full frame.
TEST(PathDeterminism, RegionEqualsFrame) {
  const auto scene = build(mixed_scene());
  const Film whole = render(*scene, kPose, 40, 40, 4);
  Film part(40, 40);
  const PixelRect region{5, 6, 18, 23};
  TraceStats stats;
  const CancelToken never;
  for (int half = 0; half < kHalves; ++half) {
    ASSERT_TRUE(
        trace_window(*scene, Camera(kPose, 40, 40, scene->origin()), {}, {half, 0, 4}, region, never, part, stats));
  }
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) {
      for (int half = 0; half < kHalves; ++half) {
        const HalfPixel expected = region.contains(x, y) ? whole.half(half, x, y) : HalfPixel{};
        ASSERT_EQ(part.half(half, x, y).sum[0], expected.sum[0]) << x << ' ' << y;
        ASSERT_EQ(part.half(half, x, y).count, expected.count);
      }
    }
  }
}

// SceneFeatures' first check: what a specialised kernel leaves out cannot be seen in a single bit.
TEST(PathDeterminism, GeneralKernelGivesTheSameBits) {
  const auto scene = build(lambert_room());
  ASSERT_TRUE(scene->features().only_lambert);
  PathSettings general;
  general.general_kernel = true;
  TraceStats plain_stats, general_stats;
  const Film plain = render(*scene, kPose, 64, 48, 16, {}, &plain_stats);
  EXPECT_TRUE(same_bits(plain, render(*scene, kPose, 64, 48, 16, general, &general_stats)));
  EXPECT_EQ(plain_stats.rays, general_stats.rays);
}

TEST(PathDeterminism, SeedsDiffer) {
  const auto scene = build(lambert_room());
  PathSettings other;
  other.seed = 1;
  EXPECT_FALSE(same_bits(render(*scene, kPose, 8, 8, 1), render(*scene, kPose, 8, 8, 1, other)));
}

TEST(PathDeterminism, CancelledWindowLeavesTheFilmAsItWas) {
  const auto scene = build(lambert_room());
  CancelToken cancelled;
  cancelled.cancel();
  Film film(16, 16);
  TraceStats stats;
  EXPECT_FALSE(trace_window(*scene, Camera(kPose, 16, 16, scene->origin()), {}, {0, 0, 4}, film.bounds(), cancelled,
                            film, stats));
  EXPECT_TRUE(same_bits(film, Film(16, 16)));
}

// The samples of a pixel are the sequence's from its start: of every two, one lies in each half of the pixel, so that a
// card that covers half of it is seen by exactly every second one. Numbered from 1 they would not be aligned.
TEST(PathSamples, StratifyThePixelFromTheFirstOn) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0, 0, 0), Rgb(1, 1, 1))};
  add_mesh(scene, quad({-2, -2, 0}, {2, 0, 0}, {0, 4, 0}, 0));  // up to x = 0
  CameraPose pose = camera_at({0, 0, 3}, {0, 0, 0});
  pose.projection = Projection::orthographic;
  pose.half_height = 1;
  const auto built = build(std::move(scene));
  for (std::uint64_t seed = 0; seed < 64; ++seed) {
    PathSettings settings;
    settings.seed = seed;
    for (const std::uint32_t samples : {2u, 4u, 6u}) {
      const Film film = render(*built, pose, 1, 1, samples, settings);
      for (int half = 0; half < kHalves; ++half)
        EXPECT_EQ(film.half(half, 0, 0).sum[0], samples / 2) << "seed " << seed << " half " << half;
    }
  }
}

// With targets every pixel gets the samples that it lacks, of the indices that follow its own, once each; their bits do
// not depend on how levels and blocks were handed out.
TEST(PathDeterminism, SampleTargetsAreMetInAnyCut) {
  const int w = 37, h = 26;
  constexpr std::uint32_t kHas = 4, kTop = 32;
  for (const bool mixed : {false, true}) {
    const auto scene = build(mixed ? mixed_scene() : lambert_room());
    const Camera camera(kPose, w, h, scene->origin());
    std::vector<Film> uniform;
    for (std::uint32_t n = kHas; n <= kTop; n *= 2) uniform.push_back(render(*scene, kPose, w, h, n));
    std::vector<Film> films;
    for (const std::uint32_t step : {kTop, 8u, 3u}) {
      Film& film = films.emplace_back(w, h, FilmState{.targets = true});
      TraceStats stats;
      for (int half = 0; half < kHalves; ++half) {
        ASSERT_TRUE(trace_window(*scene, camera, {}, {half, 0, kHas}, film.bounds(), CancelToken(), film, stats));
        for (int y = 0; y < h; ++y) {
          for (int x = 0; x < w; ++x) film.targets()->set_target(half, x, y, 2u << ((x * 7 + y * 3 + half) % 5));
        }
        const std::uint64_t wanted = film.targets()->samples_in(film, half, film.bounds(), 0, kTop);
        stats = {};
        for (std::uint32_t s = 0; s < kTop; s += step) {
          for (int y = 0; y < h; y += kPathGroupSize) {
            const PixelRect rows{0, y, w, std::min(h, y + kPathGroupSize)};
            const PixelRect window = step == kTop ? film.bounds() : rows;
            if (step == kTop && y > 0) break;
            const SampleRange range{half, s, std::min(step, kTop - s)};
            ASSERT_TRUE(trace_window(*scene, camera, {}, range, window, CancelToken(), film, stats, film.targets()));
          }
        }
        EXPECT_EQ(stats.paths, wanted);
      }
      for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
          for (int half = 0; half < kHalves; ++half) {
            const std::uint32_t count = std::max(kHas, film.targets()->target(half, x, y));
            const HalfPixel& got = film.half(half, x, y);
            ASSERT_EQ(got.count, count) << x << "," << y;
            // Other paths shared its packets: the last bits may differ.
            const HalfPixel& same = uniform[std::size_t(std::countr_zero(count / kHas))].half(half, x, y);
            for (int c = 0; c < 3; ++c) EXPECT_NEAR(got.sum[c], same.sum[c], 1e-4 * same.sum[c] + 1e-6);
          }
        }
      }
      EXPECT_TRUE(same_bits(film, films.front())) << "step " << step;
    }
  }
}

// First-hit features: the id is that of a primitive, depth is along the ray, misses are infinite.
TEST(PathFeatures, FirstHit) {
  SceneDescription scene;
  scene.materials = {lambert(Rgb(0.25f, 0.5f, 0.75f))};
  add_mesh(scene, quad({-1, -1, -9}, {2, 0, 0}, {0, 2, 0}, 0));
  add_mesh(scene, quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0));
  const Film film = render(*build(scene), camera_at({0, 0, 3}, {0, 0, 0}, 60), 33, 33, 4);
  const PixelFeatures &centre = film.features(16, 16), &corner = film.features(0, 0);
  EXPECT_LT(centre.primitive, 2u);
  EXPECT_NEAR(centre.depth, 3, 0.01);
  EXPECT_EQ(centre.count, 4u);
  EXPECT_FLOAT_EQ(centre.albedo[1], 0.5f);
  EXPECT_FLOAT_EQ(centre.normal[2], 1);
  EXPECT_EQ(centre.hits, 4u);
  EXPECT_EQ(corner.primitive, ~0u);
  EXPECT_TRUE(std::isinf(corner.depth));
  EXPECT_EQ(corner.hits, 0u);
}

}  // namespace
}  // namespace helio::test
