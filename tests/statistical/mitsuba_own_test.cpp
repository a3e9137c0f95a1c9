// Our own scenes in Mitsuba's format, for what the shared ones do not show, against their renderings by Mitsuba 3.9.1,
// per pixel and per tile by z-test: references/make says how those were made. A reference that is missing fails.
//
// Scenes with tent and Gaussian filters are compared to the edge of the film: Mitsuba adds each sample to all pixels
// whose filters reach it and divides by the sum of weights, so that a pixel near the edge is the mean over the part of
// its filter that lies on the film, as ours is. Its pixels' errors are correlated, ours are not
// (pixel_filter_sampling.h).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "renderer/scene/load/scene_loader.h"
#include "renderer/trace/sampling/pixel_filter_sampling.h"
#include "tests/statistical/estimates.h"
#include "tests/support/test_scenes.h"
#include "tests/support/tier.h"

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

// How Estimate::overlap is where each sample counts in all pixels whose filters w reach it: a sum of pixels has the
// variance of as many box-filtered ones, each pixel has only its integral of w^2, w normalised to 1, along both axes.
double overlap_of(const PixelFilter& filter) {
  constexpr int kSteps = 1 << 12;
  const double radius = pixel_filter_radius(filter), step = 2 * radius / kSteps;
  double squares = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double w = pixel_filter_density(filter, (i + 0.5) * step - radius, -radius, radius);
    squares += w * w * step;
  }
  return 1 / (squares * squares);
}

class MitsubaOwn : public testing::TestWithParam<std::string> {};

TEST_P(MitsubaOwn, PassesTheZTests) {
  Result<SceneDescription> description = load_scene(*make_directory_source(kFolder.string()), GetParam() + ".xml", {});
  ASSERT_TRUE(description.ok()) << description.error().to_string();
  EXPECT_TRUE(description->report.unread.empty()) << description->report.unread.front();
  test::Estimate reference = test::read_estimate(kFolder, GetParam());
  ASSERT_FALSE(reference.mean.empty());
  const PixelFilter filter = description->cameras.front().filter.value();
  reference.overlap = overlap_of(filter);
  const int segments = description->hints.max_segments;
  const CameraPose pose = camera_pose(description->cameras.front());
  const auto scene = test::build(std::move(*description));
  ASSERT_TRUE(scene);
  PathSettings settings;
  settings.max_segments = segments;
  const Film film = test::render(*scene, pose, reference.width, reference.height, test::by_tier(512u, 1024u), settings, nullptr, filter);
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
