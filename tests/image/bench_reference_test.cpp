// The pictures of every bench against means and variances that another renderer made: whole-picture mean within 0.5 %
// and three standard errors, and every 16x16 tile by z-test.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "renderer/codec/tile_codec.h"
#include "renderer/scene/load/scene_loader.h"
#include "tests/support/shared_data.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

constexpr int kTile = 16;
// Two-sided normal quantile for a false alarm of 1 % over 1024 tiles x 3 channels (Sidak): per test 3.3e-6.
constexpr double kTileLimit = 4.65;

struct Reference {
  std::vector<float> mean[3], variance[3];
  int width = 0, height = 0;
  double samples = 0;  // per pixel
};

Reference load_reference(const std::filesystem::path& folder, const std::string& name) {
  Reference reference;
  const char* channels[3] = {"R", "G", "B"};
  for (const bool variance : {false, true}) {
    auto picture = read_exr((folder / (name + (variance ? ".variance.exr" : ".reference.exr"))).string(), 1 << 24);
    if (!picture) {
      ADD_FAILURE() << picture.error().to_string();
      return reference;
    }
    reference.width = picture->header.frame_width;
    reference.height = picture->header.frame_height;
    for (int c = 0; c < 3; ++c) {
      const std::vector<float>* values = picture->find(channels[c]);
      if (values) (variance ? reference.variance : reference.mean)[c] = *values;
    }
  }
  return reference;
}

// Mean over a rectangle of our picture less the reference, and the standard error of that difference. Ours comes from
// the halves: each pixel's ((A - B) / 2)^2 has the expectation of the variance of its mean. Light that arrives by rare,
// bright paths is often missing from a tile together with every sign of it in the halves; the reference, which has
// thousands of samples a pixel, knows of it, so the larger of the two estimates counts.
void compare(const Film& film, const Reference& reference, const PixelRect& rect, int c, double& difference,
             double& standard_error) {
  double sum = 0, ours = 0, theirs = 0, samples = 0;
  for (int y = rect.y0; y < rect.y1; ++y) {
    for (int x = rect.x0; x < rect.x1; ++x) {
      const HalfPixel &a = film.half(0, x, y), &b = film.half(1, x, y);
      const double mean_a = a.sum[c] / a.count, mean_b = b.sum[c] / b.count;
      const std::size_t i = std::size_t(y) * std::size_t(reference.width) + std::size_t(x);
      sum += 0.5 * (mean_a + mean_b) - double(reference.mean[c][i]);
      ours += 0.25 * (mean_a - mean_b) * (mean_a - mean_b);
      theirs += double(reference.variance[c][i]);
      samples = a.count + b.count;
    }
  }
  difference = sum / double(rect.area());
  const double expected = theirs * reference.samples / samples;
  standard_error = std::sqrt(theirs + std::max(ours, expected)) / double(rect.area());
}

class BenchReference : public testing::TestWithParam<const char*> {};

TEST_P(BenchReference, AgreesWithAnotherRenderer) {
  HELIO_SHARED_OR_SKIP(folder, "scenes/bench");
  const std::string name = GetParam();
  auto description = load_scene(*make_directory_source(folder.string()), name + ".gltf", {});
  ASSERT_TRUE(description.ok()) << description.error().to_string();
  const CameraPose pose = camera_pose(description->cameras.at(0));
  const auto scene = build(std::move(*description));
  ASSERT_TRUE(scene);
  Reference reference = load_reference(folder, name);
  reference.samples = name == "cornell" ? 2048 : 8192;
  ASSERT_EQ(reference.width, 512);

  PathSettings settings;
  settings.max_segments = 10;
  const std::uint32_t samples = name == "cornell" ? 8 : 16;
  TraceStats stats;
  const Film film = render(*scene, pose, reference.width, reference.height, samples, settings, &stats);
  EXPECT_EQ(stats.invalid_samples, 0u);

  for (int c = 0; c < 3; ++c) {
    double mean = 0, difference, error;
    for (const float v : reference.mean[c]) mean += v;
    mean /= double(reference.mean[c].size());
    compare(film, reference, film.bounds(), c, difference, error);
    EXPECT_LE(std::abs(difference), 0.005 * mean) << name << " channel " << c;
    EXPECT_LE(std::abs(difference), 3 * error) << name << " channel " << c << " mean " << mean;
    int failed = 0, tiles = 0;
    double worst = 0;
    for (int y = 0; y < reference.height; y += kTile) {
      for (int x = 0; x < reference.width; x += kTile) {
        compare(film, reference, {x, y, x + kTile, y + kTile}, c, difference, error);
        ++tiles;
        // The floor stands for what both renderers round away in tiles without noise.
        const double z = std::abs(difference) / (error + 1e-5 * mean);
        worst = std::max(worst, z);
        if (z > kTileLimit) ++failed;
      }
    }
    EXPECT_EQ(tiles, 1024);
    EXPECT_EQ(failed, 0) << name << " channel " << c << ": worst z " << worst;
  }
}

INSTANTIATE_TEST_SUITE_P(Shared, BenchReference, testing::Values("cornell", "covered", "glass"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace helio::test
