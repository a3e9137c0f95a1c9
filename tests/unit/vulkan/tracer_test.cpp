// The tracer: films that it makes are the same to the bit however the work was cut, and hold beside the radiance what
// the processor's hold.
#include "renderer/vulkan/tracer.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <thread>

#include "tests/support/small_rooms.h"
#include "tests/support/tier.h"
#include "tests/unit/vulkan/test_device.h"

namespace helio::test {
namespace {

using vulkan::DeviceScene;
using vulkan::Level;
using vulkan::Tracer;

constexpr int kWidth = 40, kHeight = 24;  // neither is a multiple of a block's side
constexpr std::uint32_t kSamples = 12;

const CameraPose kPose = camera_at({0.3, 0.2, 0.9}, {-0.3, -0.3, -1}, 70);

// By our own BVH, and by the device's ray tracing.
class TracerTest : public DeviceTest, public testing::WithParamInterface<Level> {
 protected:
  TracerTest() : DeviceTest(GetParam()) {}

  void SetUp() override {
    DeviceTest::SetUp();
    if (!device()) return;
    std::shared_ptr<Tracer>& made = tracers()[GetParam()];
    if (!made) {
      std::shared_ptr<vulkan::Device> opened = device();
      if (opened->level() != GetParam()) {
        vulkan::DeviceOptions options;
        options.level = GetParam();
        auto other = vulkan::Device::open(options);
        ASSERT_TRUE(other.ok()) << other.error().to_string();
        opened = *other;
      }
      auto tracer = Tracer::create(opened);
      ASSERT_TRUE(tracer.ok()) << tracer.error().to_string();
      made = *tracer;
    }
    tracer_ = made;
  }

  void place(SceneDescription description) {
    scene_ = build(std::move(description));
    ASSERT_TRUE(scene_);
    auto placed = DeviceScene::upload(tracer_->device(), scene_);
    ASSERT_TRUE(placed.ok()) << placed.error().to_string();
    placed_ = *placed;
  }

  Result<bool> trace(Film& film, const SampleRange& range, const PixelRect& window, TraceStats& stats,
                     const CancelToken& cancel = CancelToken()) const {
    const Camera camera(kPose, film.width(), film.height(), scene_->origin());
    return tracer_->trace(*placed_, camera, settings_, range, window, cancel, film, stats);
  }
  // Whether all went well.
  bool traced(Film& film, const SampleRange& range, const PixelRect& window, TraceStats& stats) const {
    const Result<bool> done = trace(film, range, window, stats);
    if (!done.ok()) ADD_FAILURE() << done.error().to_string();
    return done.ok() && *done;
  }

  Film whole(TraceStats* stats = nullptr) const {
    Film film(kWidth, kHeight);
    TraceStats local;
    for (int half = 0; half < kHalves; ++half)
      EXPECT_TRUE(traced(film, {half, 0, kSamples}, film.bounds(), stats ? *stats : local));
    return film;
  }

  void expect_the_same_bits_however_cut();

  std::shared_ptr<Tracer> tracer_;
  std::shared_ptr<const RenderScene> scene_;
  std::shared_ptr<const DeviceScene> placed_;
  PathSettings settings_;

 private:
  // Shaders are compiled once for all tests.
  static std::map<Level, std::shared_ptr<Tracer>>& tracers() {
    static std::map<Level, std::shared_ptr<Tracer>> made;
    return made;
  }
};

std::vector<PixelRect> windows_of(int width, int height) {
  std::vector<PixelRect> windows;
  for (int y = 0; y < kHeight; y += height) {
    for (int x = 0; x < kWidth; x += width) windows.push_back({x, y, x + width, y + height});  // some reach beyond it
  }
  return windows;
}

void TracerTest::expect_the_same_bits_however_cut() {
  TraceStats stats;
  const Film first = whole(&stats);
  EXPECT_EQ(stats.paths, std::uint64_t(kWidth) * kHeight * kSamples * kHalves);
  EXPECT_GT(mean_of(first).mean.x, 0);
  EXPECT_TRUE(same_bits(first, whole())) << "traced again";

  const std::pair<int, int> kSizes[] = {{16, 16}, {3, 5}, {kWidth, 1}};
  for (const auto& [width, height] : kSizes) {
    Film film(kWidth, kHeight);
    TraceStats in_windows;
    for (const PixelRect& window : windows_of(width, height)) {
      for (int half = kHalves - 1; half >= 0; --half)
        ASSERT_TRUE(traced(film, {half, 0, kSamples}, window, in_windows));
    }
    EXPECT_TRUE(same_bits(first, film)) << "in windows of " << width << " x " << height;
    EXPECT_EQ(in_windows.rays, stats.rays);
    EXPECT_EQ(in_windows.shadow_rays, stats.shadow_rays);
    EXPECT_EQ(in_windows.paths, stats.paths);
  }

  Film in_parts(kWidth, kHeight);
  TraceStats of_parts;
  for (int half = 0; half < kHalves; ++half) {
    ASSERT_TRUE(traced(in_parts, {half, 0, 5}, in_parts.bounds(), of_parts));
    ASSERT_TRUE(traced(in_parts, {half, 5, kSamples - 5}, in_parts.bounds(), of_parts));
  }
  EXPECT_TRUE(same_bits(first, in_parts)) << "in two parts of the samples";

  // Two threads, one film: each takes the next window.
  Film shared(kWidth, kHeight);
  const std::vector<PixelRect> windows = windows_of(16, 8);
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  const auto work = [&] {
    TraceStats mine;
    for (std::size_t i = next++; i < windows.size(); i = next++) {
      for (int half = 0; half < kHalves; ++half) {
        const Result<bool> done = trace(shared, {half, 0, kSamples}, windows[i], mine);
        if (!done.ok() || !*done) failed = true;
      }
    }
  };
  std::thread other(work);
  work();
  other.join();
  EXPECT_FALSE(failed);
  EXPECT_TRUE(same_bits(first, shared)) << "by two threads";
}

TEST_P(TracerTest, TheBitsDoNotDependOnHowTheWorkIsCut) {
  place(lambert_room());
  if (placed_) expect_the_same_bits_however_cut();
}

TEST_P(TracerTest, TheBitsOfASceneWithSomethingOfEverythingDoNotEither) {
  HELIO_FULL_TIER_ONLY();
  place(mixed_scene());
  if (placed_) expect_the_same_bits_however_cut();
}

TEST_P(TracerTest, AWindowBesideTheFilmIsEmptyAndNoSamplesAreNoWork) {
  place(lambert_room());
  ASSERT_TRUE(placed_);
  Film film(kWidth, kHeight);
  TraceStats stats;
  EXPECT_TRUE(traced(film, {0, 0, kSamples}, {kWidth, 0, kWidth + 8, 8}, stats));
  EXPECT_TRUE(traced(film, {0, 0, 0}, film.bounds(), stats));
  EXPECT_TRUE(same_bits(film, Film(kWidth, kHeight)));
  EXPECT_EQ(stats.paths, 0u);

  // What lies outside of a window stays as it was.
  const PixelRect corner{kWidth - 3, kHeight - 5, kWidth + 3, kHeight + 5};
  EXPECT_TRUE(traced(film, {0, 0, kSamples}, corner, stats));
  EXPECT_EQ(stats.paths, 3u * 5 * kSamples);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool inside = x >= corner.x0 && y >= corner.y0;
      EXPECT_EQ(film.half(0, x, y).count, inside ? kSamples : 0) << x << ',' << y;
      EXPECT_EQ(film.half(1, x, y).count, 0u);
    }
  }
}

TEST_P(TracerTest, CancelledWorkLeavesTheFilmAsItWas) {
  place(lambert_room());
  ASSERT_TRUE(placed_);
  const Film before = whole();
  Film film = whole();
  TraceStats stats;
  CancelToken early;
  early.cancel();
  const Result<bool> none = trace(film, {0, kSamples, 4}, film.bounds(), stats, early);
  ASSERT_TRUE(none.ok()) << none.error().to_string();
  EXPECT_FALSE(*none);
  EXPECT_TRUE(same_bits(film, before));

  // Seconds of work, for a dispatch takes a quarter of a million samples.
  CancelToken late;
  std::thread caller([&late] {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    late.cancel();
  });
  const Result<bool> part = trace(film, {1, kSamples, 1 << 10}, film.bounds(), stats, late);
  caller.join();
  ASSERT_TRUE(part.ok()) << part.error().to_string();
  EXPECT_FALSE(*part);
  EXPECT_TRUE(same_bits(film, before));
  EXPECT_EQ(stats.paths, 0u);

  // What comes after goes on from there.
  EXPECT_TRUE(traced(film, {0, kSamples, 4}, film.bounds(), stats));
  EXPECT_EQ(film.half(0, 0, 0).count, kSamples + 4);
}

// Patches on the walls reflect NaN and infinitely much.
TEST_P(TracerTest, InvalidSamplesAreCountedAsTheProcessorDoes) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  SceneDescription description = lambert_room();
  description.materials.push_back(lambert(Rgb(nan, nan, nan)));
  description.materials.push_back(lambert(Rgb(inf, 0.5f, 0.5f)));
  add_mesh(description, quad({-0.999f, -0.2f, -0.4f}, {0, 0.3f, 0}, {0, 0, 0.3f}, 2));
  add_mesh(description, quad({0.3f, -0.999f, -0.4f}, {0, 0, 0.2f}, {0.2f, 0, 0}, 3));
  place(std::move(description));
  ASSERT_TRUE(placed_);
  TraceStats stats, expected;
  const Film film = whole(&stats);
  const Film cpu = render(*scene_, kPose, kWidth, kHeight, kSamples, settings_, &expected);
  EXPECT_GT(expected.invalid_samples, 500u);
  EXPECT_EQ(stats.invalid_samples, expected.invalid_samples);
  EXPECT_EQ(stats.first_invalid, expected.first_invalid);
  EXPECT_EQ(film.invalid_in(film.bounds()), stats.invalid_samples);
  int differing = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int half = 0; half < kHalves; ++half) {
        const HalfPixel& pixel = film.half(half, x, y);
        EXPECT_EQ(pixel.count + film.invalid(half, x, y), kSamples);
        for (int c = 0; c < 3; ++c) EXPECT_TRUE(std::isfinite(pixel.sum[c]) && std::isfinite(pixel.deviations[c]));
        differing += film.invalid(half, x, y) != cpu.invalid(half, x, y);
      }
      const PixelFeatures &a = film.features(x, y), &b = cpu.features(x, y);
      EXPECT_EQ(a.count, b.count) << x << ',' << y;
      for (int c = 0; c < 3; ++c) EXPECT_TRUE(std::isfinite(a.albedo[c]) && std::isfinite(a.normal[c]));
    }
  }
  EXPECT_EQ(differing, 0);
}

// All but for samples on edges, which rounding may move to the other side.
TEST_P(TracerTest, FeaturesAreTheProcessors) {
  SceneDescription description = lambert_room();
  description.instances.erase(description.instances.begin());  // open: rays miss
  place(std::move(description));
  ASSERT_TRUE(placed_);
  const Film film = whole();
  const Film cpu = render(*scene_, kPose, kWidth, kHeight, kSamples, settings_);
  int off = 0, missed = 0, met = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const PixelFeatures &a = film.features(x, y), &b = cpu.features(x, y);
      EXPECT_EQ(a.count, kSamples);
      missed += b.hits == 0;
      met += b.hits == kSamples;
      bool same = a.hits == b.hits && a.primitive == b.primitive && std::isfinite(a.depth) == std::isfinite(b.depth);
      if (std::isfinite(b.depth)) same = same && std::abs(a.depth - b.depth) <= 1e-5f * b.depth;
      for (int c = 0; c < 3; ++c)
        same = same && std::abs(a.albedo[c] - b.albedo[c]) <= 1e-5f && std::abs(a.normal[c] - b.normal[c]) <= 1e-5f;
      off += !same;
    }
  }
  EXPECT_GT(missed, 50);
  EXPECT_GT(met, 50);
  EXPECT_LE(off, 2);
}

INSTANTIATE_TEST_SUITE_P(, TracerTest, testing::Values(Level::compute, Level::rt),
                         [](const auto& info) { return std::string(vulkan::level_name(info.param)); });

}  // namespace
}  // namespace helio::test
