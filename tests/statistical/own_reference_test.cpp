// The project's own scenes against pictures that its renderer had no part in, per pixel and per tile by z-test, with
// and without light paths: references/README.md says what made them. A reference that is missing fails.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>

#include "tests/bench/render_modes.h"
#include "tests/statistical/estimates.h"
#include "tests/support/loop_picture.h"
#include "tests/support/own_scenes.h"
#include "tests/support/tier.h"

namespace helio::test {
namespace {

const std::filesystem::path kSource = HELIO_SOURCE_DIR;

constexpr int kReferenceSamples = 64 * 1024;

struct OwnReferenceScene {
  const char* name;
  bool lights_sampled = true;  // by the reference as by us, so that its variance tells what ours should be
};

constexpr OwnReferenceScene kScenes[] = {{"cornell-box"},  {"cornell-covered"}, {"cornell-glossy"}, {"cornell-spheres"},
                                         {"veach-plates"}, {"furnace"},         {"layers", false}};

// Light that arrives by rare, bright paths is often missing from a pixel together with every sign of it in the
// variance; the reference, which has many times the samples, knows of it, so the larger of the two counts.
Estimate with_what_is_rare(Estimate rendering, int samples, const Estimate& reference) {
  for (std::size_t i = 0; i < rendering.variance.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double by_reference = reference.variance[i][c] * kReferenceSamples / samples;
      rendering.variance[i][c] = std::max(rendering.variance[i][c], by_reference);
    }
  }
  return rendering;
}

// A variance that is not backed by the reference's takes the samples of the full tier to be known.
int samples_of(const OwnReferenceScene& scene) {
  return scene.lights_sampled ? by_tier(512, 2048) : 2048;
}

class OwnReference : public testing::TestWithParam<OwnReferenceScene> {};

TEST_P(OwnReference, PassesTheZTests) {
  const std::string name = GetParam().name;
  const Estimate reference = read_estimate(kSource / "tests/statistical/references", name);
  ASSERT_FALSE(reference.mean.empty());
  const auto scene = load_own_scene(name);
  ASSERT_TRUE(scene);
  PathSettings settings;
  settings.max_segments = name == "furnace" ? 200 : 10;  // what a path loses by being cut off is nothing in the furnace
  settings.seed = 4;
  const Film film = render(*scene, camera_pose(scene->description().cameras.at(0)), reference.width, reference.height,
                           std::uint32_t(samples_of(GetParam()) / kHalves), settings);
  Estimate rendering = estimate_of(film);
  if (GetParam().lights_sampled) rendering = with_what_is_rare(std::move(rendering), samples_of(GetParam()), reference);
  const ZTestResult result = z_test(rendering, reference);
  std::printf("%s: %s\n", name.c_str(), result.to_string().c_str());
  EXPECT_TRUE(result.passed()) << result.to_string();
}

INSTANTIATE_TEST_SUITE_P(Scenes, OwnReference, testing::ValuesIn(kScenes),
                         [](const auto& info) { return test_name_of(info.param.name); });

// Light paths correlate pixels, so that a picture's own variances are too small for tiles: those of pictures that have
// nothing in common tell what the variance is, of pixels and of tiles.
constexpr int kBatches = 16, kBatchSamples = 64;

Estimate estimate_of(const std::vector<LoopPicture>& batches) {
  const int width = batches.front().width, height = batches.front().height;
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  const double count = double(batches.size());
  const auto variance_of_mean = [&](double sum, double squares) {
    return std::max(squares - sum * sum / count, 0.0) / (count * (count - 1));
  };
  Estimate estimate{width, height, std::vector<V3d>(pixels), std::vector<V3d>(pixels)};
  double of_tiles = 0, of_their_pixels = 0;
  for (int c = 0; c < 3; ++c) {
    for (int y0 = 0; y0 < height; y0 += kTileSide) {
      for (int x0 = 0; x0 < width; x0 += kTileSide) {
        std::vector<double> tile(batches.size(), 0.0);
        for (int y = y0; y < std::min(y0 + kTileSide, height); ++y) {
          for (int x = x0; x < std::min(x0 + kTileSide, width); ++x) {
            const std::size_t i = std::size_t(y) * std::size_t(width) + std::size_t(x);
            double sum = 0, squares = 0;
            for (std::size_t b = 0; b < batches.size(); ++b) {
              const double value = batches[b].channels[c][i];
              sum += value;
              squares += value * value;
              tile[b] += value;
            }
            estimate.mean[i][c] = sum / count;
            estimate.variance[i][c] = variance_of_mean(sum, squares);
            of_their_pixels += estimate.variance[i][c];
          }
        }
        double sum = 0, squares = 0;
        for (const double value : tile) {
          sum += value;
          squares += value * value;
        }
        of_tiles += variance_of_mean(sum, squares);
      }
    }
  }
  estimate.overlap = std::max(1.0, of_tiles / of_their_pixels);
  return estimate;
}

class OwnReferenceWithLightPaths : public testing::TestWithParam<std::tuple<OwnReferenceScene, bench::ComparedMode>> {};

TEST_P(OwnReferenceWithLightPaths, PassesTheZTests) {
  const auto& [own, mode] = GetParam();
  if (mode.name != std::string("pt+bdpt")) HELIO_FULL_TIER_ONLY();
  const std::string name = own.name;
  const Estimate reference = read_estimate(kSource / "tests/statistical/references", name);
  ASSERT_FALSE(reference.mean.empty());
  const auto scene = load_own_scene(name);
  ASSERT_TRUE(scene);
  RenderEngine engine(2);
  RenderSettings settings;
  settings.width = reference.width;
  settings.height = reference.height;
  mode.choose_in(settings);
  Budget budget;
  budget.samples = kBatchSamples;
  std::vector<LoopPicture> batches;
  for (int b = 0; b < kBatches; ++b) {
    settings.seed = 300 + std::uint64_t(b);
    batches.push_back(render_through_loop(engine, scene, settings, budget));
    ASSERT_EQ(batches.back().end.reason, FrameEndReason::samples);
  }
  const Estimate rendering = estimate_of(batches);
  ZTestResult result = z_test(
      own.lights_sampled ? with_what_is_rare(rendering, kBatches * kBatchSamples, reference) : rendering, reference);
  result.worst_tile = z_test(rendering, reference).worst_tile;  // tiles have seen what is rare
  std::printf("%s, %s: %s, tiles' variance over their pixels' %.2f\n", own.name, mode.name, result.to_string().c_str(),
              rendering.overlap);
  EXPECT_TRUE(result.passed()) << result.to_string();
}

std::vector<bench::ComparedMode> unbiased_modes_with_light_paths() {
  std::vector<bench::ComparedMode> modes;
  for (const bench::ComparedMode& mode : bench::kRenderModes) {
    if (mode.integrator == Integrator::bdpt || mode.integrator == Integrator::pt_bdpt ||
        mode.integrator == Integrator::lvc)
      modes.push_back(mode);
  }
  return modes;
}

// The furnace has nothing that light paths could begin at.
std::vector<OwnReferenceScene> scenes_with_lamps() {
  std::vector<OwnReferenceScene> scenes;
  std::copy_if(std::begin(kScenes), std::end(kScenes), std::back_inserter(scenes),
               [](const OwnReferenceScene& scene) { return scene.name != std::string("furnace"); });
  return scenes;
}

INSTANTIATE_TEST_SUITE_P(Scenes, OwnReferenceWithLightPaths,
                         testing::Combine(testing::ValuesIn(scenes_with_lamps()),
                                          testing::ValuesIn(unbiased_modes_with_light_paths())),
                         [](const auto& info) {
                           return test_name_of(std::string(std::get<0>(info.param).name) + "-" +
                                               std::get<1>(info.param).name);
                         });

TEST(OwnReferenceFolder, NoSceneIsForgotten) {
  for (const auto& entry : std::filesystem::directory_iterator(kSource / "scenes")) {
    const std::string name = entry.path().filename().string();
    if (!std::filesystem::exists(entry.path() / (name + ".gltf"))) continue;
    const auto listed = [&](const OwnReferenceScene& scene) { return name == scene.name; };
    EXPECT_TRUE(std::any_of(std::begin(kScenes), std::end(kScenes), listed)) << name;
  }
}

}  // namespace
}  // namespace helio::test
