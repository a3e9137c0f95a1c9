// The project's own scenes against pictures that its renderer had no part in, per pixel and per tile by z-test:
// references/README.md says what made them. A reference that is missing fails.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>

#include "tests/statistical/estimates.h"
#include "tests/support/own_scenes.h"

namespace helio::test {
namespace {

const std::filesystem::path kSource = HELIO_SOURCE_DIR;

constexpr int kSamples = 2048, kReferenceSamples = 64 * 1024;

struct OwnReferenceScene {
  const char* name;
  bool lights_sampled = true;  // by the reference as by us, so that its variance tells what ours should be
};

constexpr OwnReferenceScene kScenes[] = {{"cornell-box"},  {"cornell-covered"}, {"cornell-glossy"}, {"cornell-spheres"},
                                         {"veach-plates"}, {"furnace"},         {"layers", false}};

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
                           kSamples / kHalves, settings);
  // Light that arrives by rare, bright paths is often missing from a pixel together with every sign of it in the
  // variance; the reference, which has 32 times the samples, knows of it, so the larger of the two counts.
  Estimate rendering = estimate_of(film);
  for (std::size_t i = 0; GetParam().lights_sampled && i < rendering.variance.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double by_reference = reference.variance[i][c] * kReferenceSamples / kSamples;
      rendering.variance[i][c] = std::max(rendering.variance[i][c], by_reference);
    }
  }
  const ZTestResult result = z_test(rendering, reference);
  std::printf("%s: %s\n", name.c_str(), result.to_string().c_str());
  EXPECT_TRUE(result.passed()) << result.to_string();
}

INSTANTIATE_TEST_SUITE_P(Scenes, OwnReference, testing::ValuesIn(kScenes),
                         [](const auto& info) { return test_name_of(info.param.name); });

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
