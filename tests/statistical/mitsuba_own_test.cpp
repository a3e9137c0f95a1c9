// Our own scenes in Mitsuba's format, for what the shared ones do not show, against their renderings by Mitsuba 3.9.1,
// per pixel and per tile by z-test: references/make says how those were made. A reference that is missing fails.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "renderer/scene/scene_loader.h"
#include "tests/statistical/estimates.h"
#include "tests/support/test_scenes.h"

namespace helio {
namespace {

const std::filesystem::path kFolder = std::filesystem::path(HELIO_SOURCE_DIR) / "tests/statistical/references";

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder))
    if (entry.path().extension() == ".xml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

class MitsubaOwn : public testing::TestWithParam<std::string> {};

TEST_P(MitsubaOwn, PassesTheZTests) {
  Result<SceneDescription> description = load_scene(*make_directory_source(kFolder.string()), GetParam() + ".xml", {});
  ASSERT_TRUE(description.ok()) << description.error().to_string();
  EXPECT_TRUE(description->report.unread.empty()) << description->report.unread.front();
  const test::Estimate reference = test::read_estimate(kFolder, GetParam());
  ASSERT_FALSE(reference.mean.empty());
  const CameraPose pose = camera_pose(description->cameras.front());
  const auto scene = test::build(std::move(*description));
  ASSERT_TRUE(scene);
  PathSettings settings;
  settings.max_segments = 6;  // as the files say
  const Film film = test::render(*scene, pose, reference.width, reference.height, 1024, settings);
  const test::ZTestResult result = test::z_test(test::estimate_of(film), reference);
  std::printf("%s: %s\n", GetParam().c_str(), result.to_string().c_str());
  EXPECT_TRUE(result.passed()) << result.to_string();
}

INSTANTIATE_TEST_SUITE_P(Scenes, MitsubaOwn, testing::ValuesIn(scene_names()), [](const auto& info) {
  std::string name = info.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

}  // namespace
}  // namespace helio
