// The scenes that the project ships load without a word of complaint and have the mean radiance that their folders
// promise (scenes/NAME/expected.json).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "renderer/film/estimate/resolve.h"
#include "tests/support/own_scenes.h"

namespace helio {
namespace {

const std::string kScenes = std::string(HELIO_SOURCE_DIR) + "/scenes/";

class OwnScene : public testing::TestWithParam<const char*> {};

TEST_P(OwnScene, HasTheMeanRadianceThatItPromises) {
  const std::string name = GetParam();
  const nlohmann::json expected = nlohmann::json::parse(std::ifstream(kScenes + name + "/expected.json"));
  const std::shared_ptr<const RenderScene> scene = test::load_own_scene(name);
  ASSERT_TRUE(scene);
  const CameraDescription& camera = scene->description().cameras.at(0);
  PathSettings settings;
  settings.max_segments = expected.at("max_segments");
  settings.seed = 20260;  // not the seed of the expected numbers
  const int height = 64, width = int(std::lround(height * camera.aspect));
  TraceStats stats;
  const Film film = test::render(*scene, camera_pose(camera), width, height, 32, settings, &stats);
  EXPECT_EQ(stats.invalid_samples, 0u);
  const test::MeanEstimate found = test::mean_of(film);
  for (int c = 0; c < 3; ++c) {
    const double error = std::hypot(found.standard_error[c], double(expected.at("standard_error")));
    // A hundredth more: the tail of caustics is longer than its standard error says.
    EXPECT_NEAR(found.mean[c], double(expected.at("mean").at(c)), 4 * error + 0.01 * found.mean[c]) << "channel " << c;
  }
}

INSTANTIATE_TEST_SUITE_P(All, OwnScene,
                         testing::Values("cornell-box", "cornell-glossy", "cornell-spheres", "cornell-covered",
                                         "veach-plates", "furnace", "layers"),
                         [](const auto& info) { return test::test_name_of(info.param); });

TEST(OwnScenes, NothingIsSeenInTheFurnace) {
  const std::shared_ptr<const RenderScene> scene = test::load_own_scene("furnace");
  ASSERT_TRUE(scene);
  PathSettings settings;
  settings.max_segments = 200;  // what a path loses by being cut off there is nothing
  const int width = 64, height = 32;
  const Film film = test::render(*scene, camera_pose(scene->description().cameras.at(0)), width, height, 64, settings);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Rgb radiance = resolve_mean(film, x, y);
      // Only where the white sphere sees the others does an estimate vary at all: lights and directions are chosen
      // there, and roulette ends paths.
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(radiance[c], 1, 0.08) << x << ", " << y;
    }
  }
  const test::MeanEstimate found = test::mean_of(film);
  EXPECT_NEAR(found.mean.x, 1, 4 * found.standard_error.x + 1e-5);
}

// The generator's landscapes have exactly the number of triangles asked for, full last row or not.
TEST(OwnScenes, LandscapesHaveTheTrianglesAskedFor) {
  const std::string python = HELIO_PYTHON;
  if (python.empty()) GTEST_SKIP() << "skipped: no Python 3";
  const std::filesystem::path directory = testing::TempDir();
  const std::unique_ptr<FileSource> source = make_directory_source(directory.string());
  for (const int triangles : {1, 2, 777, 20000}) {
    const std::string file = "landscape-" + std::to_string(triangles) + ".glb";
    const std::string command = python + " -B '" + HELIO_SOURCE_DIR + "/scenes/generate' --triangles " +
                                std::to_string(triangles) + " --output '" + (directory / file).string() + "'";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    Result<SceneDescription> scene = load_scene(*source, file, {});
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    EXPECT_TRUE(scene->report.warnings.empty()) << scene->report.warnings.at(0);
    EXPECT_EQ(scene->objects.at(0).meshes.at(0).triangle_count(), std::size_t(triangles));
    std::filesystem::remove(directory / file);
  }
}

}  // namespace
}  // namespace helio
