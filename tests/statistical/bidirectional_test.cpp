// Bidirectional path tracing, light tracing and tiles of either make the picture that the path tracer makes.
//
// The path tracer knows nothing of light paths, so it is the reference. The mean of every comparison lies within three
// standard errors, and these are small enough to see a fault of a few tenths of a percent. Of some two hundred means
// one in two runs would have one that misses by chance: what misses is made once more, with other random numbers and
// twice the batches, and must not miss again.
//
// What `light` cannot sample: all that the camera sees through mirrors and glass, directly or in a chain; and, where a
// map's or a mesh's normal is bent towards whoever looks, the directions to the camera that the normal as the light
// sees it does not admit (1.7 % of the light in NormalMap). It is compared in the scenes that show neither, or so
// little of the latter that it does not count (BidirectionalScene::light_sees_all).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/statistical/batch_comparison.h"
#include "tests/statistical/bidirectional_scenes.h"
#include "tests/support/light_cache.h"
#include "tests/support/loop_picture.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

// Two by one tiles of light paths, the second a narrow one; the film cuts blocks of 16 pixels in the second.
constexpr int kWidth = 40, kHeight = 24;
static_assert(kWidth > kLightTile);

class Renderer {
 public:
  explicit Renderer(const BidirectionalScene& scene) : scene_(scene), built_(build(scene.description)) {}
  bool built() const { return built_ != nullptr; }

  // Two batches a seed, its halves. `tiles`: null for light paths everywhere.
  Batches make(Integrator integrator, int first_seed, int seeds, std::shared_ptr<const LightTiles> tiles = {}) const {
    Batches batches{kWidth, kHeight, {}};
    for (int seed = first_seed; seed < first_seed + seeds; ++seed) {
      const Film film = render(integrator, std::uint64_t(seed), tiles);
      for (int half = 0; half < kHalves; ++half) batches.pictures.push_back(pixels_of(film, half));
    }
    return batches;
  }

 private:
  Film render(Integrator integrator, std::uint64_t seed, const std::shared_ptr<const LightTiles>& tiles) const {
    FilmState state;
    state.splats = traces_light_paths(integrator);
    Film film(kWidth, kHeight, state);
    film.set_light_tiles(tiles);
    const Camera camera(scene_.pose, kWidth, kHeight, built_->origin(), scene_.filter);
    PathSettings settings;
    settings.seed = seed;
    settings.max_segments = scene_.max_segments;
    settings.integrator = integrator;
    const CancelToken never;
    TraceStats stats;
    const LightTiles whole(kWidth, kHeight, true);
    const auto trace = [&](const SampleRange& range, const LightVertexCache* lights) {
      for (std::size_t t = 0; t < whole.size(); ++t) {
        EXPECT_TRUE(
            trace_window(*built_, camera, settings, range, whole.window(t), never, film, stats, nullptr, lights));
      }
    };
    for (int half = 0; half < kHalves; ++half) {
      if (!caches_light_vertices(integrator)) {
        trace({half, 0, scene_.samples}, nullptr);
        continue;
      }
      for (std::uint32_t sample = 0; sample < scene_.samples; ++sample) {
        const auto lights = make_light_cache(built_, settings, half, sample, kWidth * kHeight, &camera, film, stats);
        trace({half, sample, 1}, lights.get());
      }
    }
    EXPECT_EQ(stats.invalid_samples, 0u);
    EXPECT_EQ(film.splats() ? film.splats()->invalid_in(film.bounds()) : 0u, 0u);
    return film;
  }

  static std::vector<V3d> pixels_of(const Film& film, int half) {
    std::vector<V3d> pixels;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const HalfPixel& pixel = film.half(half, x, y);
        V3d mean(0, 0, 0);
        const Rgb splats = film.splats() ? film.splats()->mean(half, x, y) : Rgb(0, 0, 0);
        for (int c = 0; c < 3; ++c) mean[c] = pixel.sum[c] / std::max(1u, pixel.count) + splats[c];
        pixels.push_back(mean);
      }
    }
    return pixels;
  }

  BidirectionalScene scene_;
  std::shared_ptr<const RenderScene> built_;
};

// Seeds of one reference and of what is compared with it; those of second tries follow.
constexpr int kReferenceSeed = 1000, kSeed = 1, kAgain = 5000, kReferenceAgain = 15000;
// Doublings of the seeds, at most, until the standard error is small enough.
constexpr int kDoublings = 5;
// Of `light`, which takes four times as many to be as sure as the others.
constexpr double kLightErrors = 2;

void expect_agreement(const Renderer& renderer, const BidirectionalScene& scene, const Batches& reference,
                      const std::string& name, Integrator integrator, int seeds, double largest_error,
                      const std::shared_ptr<const LightTiles>& tiles = {}) {
  Batches made = renderer.make(integrator, kSeed, seeds, tiles);
  BatchComparison comparison = compare(made, reference);
  for (int k = 0; k < kDoublings && comparison.standard_error > largest_error; ++k, seeds *= 2) {
    for (std::vector<V3d>& picture : renderer.make(integrator, kSeed + seeds, seeds, tiles).pictures)
      made.pictures.push_back(std::move(picture));
    comparison = compare(made, reference);
  }
  std::printf("  %-10s %s\n", name.c_str(), comparison.to_string().c_str());
  if (!comparison.passed()) {
    comparison = compare(renderer.make(integrator, kAgain, 2 * seeds, tiles),
                         renderer.make(Integrator::path, kReferenceAgain, 2 * scene.seeds));
    std::printf("  once more  %s\n", comparison.to_string().c_str());
  }
  EXPECT_TRUE(comparison.passed()) << name << ": " << comparison.to_string();
  EXPECT_LE(comparison.standard_error, largest_error) << name << " is too noisy to tell";
}

class Bidirectional : public testing::TestWithParam<NamedBidirectionalScene> {};

TEST_P(Bidirectional, AgreesWithThePathTracer) {
  if (!GetParam().in_short_tier) HELIO_FULL_TIER_ONLY();
  const BidirectionalScene scene = GetParam().make();
  const Renderer renderer(scene);
  ASSERT_TRUE(renderer.built());
  const Batches reference = renderer.make(Integrator::path, kReferenceSeed, scene.seeds);
  expect_agreement(renderer, scene, reference, "bdpt", Integrator::bdpt, scene.seeds, scene.largest_error);
  expect_agreement(renderer, scene, reference, "lvc", Integrator::lvc, scene.seeds, scene.largest_error);
  if (scene.light_sees_all)
    expect_agreement(renderer, scene, reference, "light", Integrator::light, scene.seeds,
                     kLightErrors * scene.largest_error);
  for (const std::size_t on : {0, 1}) {
    const auto tiles = std::make_shared<LightTiles>(kWidth, kHeight, false);
    tiles->set(on, true);
    expect_agreement(renderer, scene, reference, on == 0 ? "left bdpt" : "right bdpt", Integrator::pt_bdpt,
                     scene.seeds / 4, scene.largest_error, tiles);
  }
}

BidirectionalScene scene_named(const std::string& name) {
  for (const NamedBidirectionalScene& scene : bidirectional_scenes()) {
    if (scene.name == name) return scene.make();
  }
  ADD_FAILURE() << "no scene " << name;
  return {};
}

// Of paths of a length alone, which have half the batches.
constexpr double kLengthErrors = 5;

// Each number of segments by itself: what one brings too much another must not make up for.
TEST(BidirectionalLengths, AgreeOneByOne) {
  BidirectionalScene scene = scene_named("DiffuseRoom");
  for (const int segments : {1, 2, 3, 4}) {
    std::printf("%d segments\n", segments);
    scene.max_segments = segments;
    const Renderer renderer(scene);
    ASSERT_TRUE(renderer.built());
    const Batches reference = renderer.make(Integrator::path, kReferenceSeed, scene.seeds / 2);
    for (const Integrator integrator : {Integrator::bdpt, Integrator::light}) {
      expect_agreement(renderer, scene, reference, to_string(integrator), integrator, scene.seeds / 2,
                       kLengthErrors * scene.largest_error);
    }
  }
}

// Connections to vertices near the light have no bound but their weights. The brightest pixel of 32 pictures of 16
// samples is at most twice that of the converged one, whose brightest spot is lit by the light directly.
TEST(BidirectionalFireflies, APointInAClosedBoxLeavesNone) {
  const BidirectionalScene scene = scene_named("PointInClosedBox");
  const Renderer renderer(scene);
  ASSERT_TRUE(renderer.built());
  const auto largest = [](const std::vector<V3d>& picture) {
    double value = 0;
    for (const V3d& pixel : picture) value = std::max({value, pixel.x, pixel.y, pixel.z});
    return value;
  };
  const Batches reference = renderer.make(Integrator::path, kReferenceSeed, scene.seeds);
  std::vector<V3d> converged(reference.pictures[0].size(), V3d(0, 0, 0));
  for (const std::vector<V3d>& picture : reference.pictures) {
    for (std::size_t i = 0; i < picture.size(); ++i) converged[i] += picture[i] / double(reference.pictures.size());
  }
  double brightest = 0;
  for (const std::vector<V3d>& picture : renderer.make(Integrator::bdpt, kSeed, scene.seeds).pictures)
    brightest = std::max(brightest, largest(picture));
  std::printf("  brightest pixel %.4g, converged %.4g\n", brightest, largest(converged));
  EXPECT_LE(brightest, 2 * largest(converged));
}

// Through the render loop, a picture a batch: counts and tiles are as a frame chooses them for itself.
struct LoopBatches {
  Batches pictures;
  int mixed = 0;  // pictures in which some samples came with a light path, and others did not
};

LoopBatches make_in_loop(const BidirectionalScene& scene, const std::shared_ptr<const RenderScene>& built,
                         RenderSettings settings, int first_seed, int seeds, std::uint32_t samples) {
  RenderEngine engine(2);
  settings.max_segments = scene.max_segments;
  settings.filter = scene.filter;
  Budget budget;
  budget.samples = samples;
  LoopBatches made{{settings.width, settings.height, {}}};
  for (int seed = first_seed; seed < first_seed + seeds; ++seed) {
    settings.seed = std::uint64_t(seed);
    const LoopPicture picture = render_through_loop(engine, built, settings, budget, scene.pose);
    EXPECT_EQ(picture.end.reason, FrameEndReason::samples);
    std::vector<V3d> pixels(picture.channels[0].size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      for (int c = 0; c < 3; ++c) pixels[i][c] = double(picture.channels[c][i]);
    }
    made.pictures.pictures.push_back(std::move(pixels));
    const TraceStats& trace = picture.end.progress.trace;
    made.mixed += trace.light_paths > 0 && trace.light_paths < trace.paths;
  }
  return made;
}

void expect_agreement(const BatchComparison& comparison, const char* name, double largest_error) {
  std::printf("  %-10s %s\n", name, comparison.to_string().c_str());
  EXPECT_TRUE(comparison.passed()) << name << ": " << comparison.to_string();
  EXPECT_LE(comparison.standard_error, largest_error) << name << " is too noisy to tell";
}

// Each picture chooses its tiles by its own probe. A choice that followed the samples of the picture, or tiles whose
// light paths counted twice where they border on others, would show.
TEST(BidirectionalChoice, TilesThatAPictureChoosesForItselfAgree) {
  const BidirectionalScene scene = half_covered();
  const auto built = build(scene.description);
  ASSERT_TRUE(built);
  RenderSettings settings;
  settings.width = 8 * kLightTile;
  settings.height = 4 * kLightTile;
  settings.integrator = Integrator::pt_bdpt;
  constexpr int kPictures = 12;
  const LoopBatches mixed = make_in_loop(scene, built, settings, kSeed, kPictures, 8);
  std::printf("  %d of %d pictures are mixed\n", mixed.mixed, kPictures);
  EXPECT_GE(3 * mixed.mixed, kPictures) << "else little is tested here";
  settings.integrator = Integrator::bdpt;  // paths alone would be too noisy under the cover
  const LoopBatches reference = make_in_loop(scene, built, settings, kReferenceSeed, kPictures, 12);
  expect_agreement(compare(mixed.pictures, reference.pictures), "own choice", scene.largest_error);
}

// Counts follow the variance of samples and splats together; the pilots of the halves are crossed, so that the mean
// stays where it is.
TEST(BidirectionalAdaptive, CountsThatDifferAgree) {
  HELIO_FULL_TIER_ONLY();
  const BidirectionalScene scene = scene_named("LampBehindFrostedGlass");
  const auto built = build(scene.description);
  ASSERT_TRUE(built);
  RenderSettings settings;
  settings.width = kWidth;
  settings.height = kHeight;
  settings.integrator = Integrator::bdpt;
  settings.mode = RenderMode::adaptive;
  const LoopBatches adaptive = make_in_loop(scene, built, settings, kSeed, 24, 64);
  settings.mode = RenderMode::pt;
  settings.integrator = Integrator::path;
  const LoopBatches reference = make_in_loop(scene, built, settings, kReferenceSeed, 24, 256);
  expect_agreement(compare(adaptive.pictures, reference.pictures), "adaptive", 0.005);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Bidirectional,
                         testing::ValuesIn(bidirectional_scenes().begin(), bidirectional_scenes().end()),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace helio::test
