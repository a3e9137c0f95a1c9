// Scenes in Mitsuba's format against their renderings by Mitsuba 3.9.1: the loader and everything behind it.
//
// Every scene of the folder is listed here, either as one that passes the z-tests or with the plugin that the loader
// refuses it for: a scene that starts to load must move to the first list.
#include <gtest/gtest.h>

#include <cstdio>

#include "renderer/scene/load/scene_loader.h"
#include "tests/statistical/estimates.h"
#include "tests/support/shared_data.h"
#include "tests/support/test_scenes.h"
#include "tests/support/tier.h"

namespace helio {
namespace {

constexpr const char* kFolder = "scenes/mitsuba-references";

struct ReferenceScene {
  const char* name;
  const char* refused_for;      // null: renders
  std::uint32_t samples = 128;  // in each half
};

constexpr ReferenceScene kScenes[] = {
    {"box-checker", nullptr},
    {"ggx-conductors", nullptr},
    {"beckmann-anisotropic", nullptr, 512},
    {"glass-and-frosted", nullptr},
    {"plastics-and-pane", nullptr},
    {"principled-grid", nullptr},
    {"environment-map", nullptr},
    {"delta-lights", nullptr},
    {"textures-normal-blend-mask", nullptr, 512},  // its caustics are dim: with 128 they hide in the noise
    {"instances-shapes-thinlens", nullptr},
};

Result<SceneDescription> load(const std::filesystem::path& root, const std::string& name) {
  return load_scene(*make_directory_source(root.string()), name + ".xml", {});
}

class MitsubaReference : public testing::TestWithParam<ReferenceScene> {};

TEST_P(MitsubaReference, PassesTheZTestsOrIsRefusedByName) {
  HELIO_SHARED_OR_SKIP(root, kFolder);
  const std::string name = GetParam().name;
  if (name == "beckmann-anisotropic") HELIO_FULL_TIER_ONLY();
  Result<SceneDescription> description = load(root, name);
  if (GetParam().refused_for) {
    ASSERT_FALSE(description.ok()) << name << " loads now: compare it with its reference";
    EXPECT_EQ(description.error().code, ErrorCode::unimplemented);
    EXPECT_NE(description.error().message.find(GetParam().refused_for), std::string::npos)
        << description.error().to_string();
    std::printf("not supported: %s: %s\n", name.c_str(), description.error().to_string().c_str());
    return;
  }
  ASSERT_TRUE(description.ok()) << description.error().to_string();
  EXPECT_TRUE(description->report.unread.empty()) << description->report.unread.front();
  const test::Estimate reference = test::read_estimate(root, name);
  ASSERT_FALSE(reference.mean.empty());
  const CameraPose pose = camera_pose(description->cameras.front());
  const auto scene = test::build(std::move(*description));
  ASSERT_TRUE(scene);
  const Film film = test::render(*scene, pose, reference.width, reference.height, GetParam().samples);
  const test::ZTestResult result = test::z_test(test::estimate_of(film), reference);
  std::printf("%s: %s\n", name.c_str(), result.to_string().c_str());
  EXPECT_TRUE(result.passed()) << result.to_string();
}

INSTANTIATE_TEST_SUITE_P(Scenes, MitsubaReference, testing::ValuesIn(kScenes), [](const auto& info) {
  std::string name = info.param.name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST(MitsubaReferenceFolder, HoldsNoSceneThatIsNotListed) {
  HELIO_SHARED_OR_SKIP(root, kFolder);
  for (const auto& entry : std::filesystem::directory_iterator(root)) {
    if (entry.path().extension() != ".xml") continue;
    const std::string name = entry.path().stem().string();
    const auto listed = [&](const ReferenceScene& scene) { return name == scene.name; };
    EXPECT_TRUE(std::any_of(std::begin(kScenes), std::end(kScenes), listed)) << name;
  }
}

}  // namespace
}  // namespace helio
