// The scenes of scenes/generate --scene load without complaint, are as large as they are said to be and show something.
#include "tests/bench/scenes/generated_scenes.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <ostream>

#include "renderer/scene/load/scene_loader.h"
#include "tests/bench/scenes/scene_depth.h"
#include "tests/support/own_scenes.h"

namespace helio::bench {
namespace {

namespace fs = std::filesystem;

struct Expected {
  const char* name;
  std::size_t triangles;
};

void PrintTo(const Expected& expected, std::ostream* out) {
  *out << expected.name;
}

// Walls 2 each, lamp 2, block 10, with its bottom 12; a lump of R rows and C columns 2 C (R - 1); the highlight's
// floor, wall and block (its lamp is a sphere); the courtyard's crowns, 13 x 125 of 3,200 quads, trunks of 8, ground
// and walls.
class GeneratedScene : public testing::TestWithParam<Expected> {};

TEST_P(GeneratedScene, LoadsAndShowsSomething) {
  if (std::system("python3 -c ''") != 0) GTEST_SKIP() << "skipped: no Python 3";
  const fs::path folder = fs::path(testing::TempDir()) / (std::string("helio_generated_") + GetParam().name);
  fs::remove_all(folder);
  const auto file = generate_scene(folder, GetParam().name);
  ASSERT_TRUE(file.ok()) << file.error().to_string();
  const auto written = fs::last_write_time(*file);
  EXPECT_EQ(*generate_scene(folder, GetParam().name), *file);
  EXPECT_EQ(fs::last_write_time(*file), written) << "written again";
  const auto source = make_directory_source(file->parent_path().string());
  Result<SceneDescription> scene = load_scene(*source, file->filename().string(), {});
  ASSERT_TRUE(scene.ok()) << scene.error().to_string();
  EXPECT_TRUE(scene->report.warnings.empty() && scene->report.notices.empty() && scene->report.unread.empty());
  std::size_t triangles = 0;
  for (const Instance& instance : scene->instances) {
    for (const TriangleMesh& mesh : scene->objects.at(std::size_t(instance.object)).meshes) {
      triangles += mesh.triangle_count();
    }
  }
  EXPECT_EQ(triangles, GetParam().triangles);
  const auto built = test::build(std::move(*scene));
  ASSERT_TRUE(built);
  const CameraPose view = camera_pose(built->description().cameras.at(0));
  EXPECT_TRUE(scene_depth(*built, view).ok());
  TraceStats stats;
  const Film film = test::render(*built, view, 32, 18, 8, {}, &stats);
  EXPECT_EQ(stats.invalid_samples, 0u);
  const test::MeanEstimate mean = test::mean_of(film);
  for (int c = 0; c < 3; ++c) EXPECT_GT(mean.mean[c], 3 * mean.standard_error[c]) << c;
  fs::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(All, GeneratedScene,
                         testing::Values(Expected{"box-area", 34}, Expected{"box-point", 32},
                                         Expected{"box-directional", 30}, Expected{"box-69k", 69446},
                                         Expected{"box-1m", 1087862}, Expected{"box-low-roughness", 34},
                                         Expected{"box-glass", 38}, Expected{"box-glossy", 34},
                                         Expected{"highlight", 14}, Expected{"courtyard", 10401010}),
                         [](const auto& info) { return test::test_name_of(info.param.name); });

TEST(GeneratedScenes, AreThoseThatAreTested) {
  EXPECT_EQ(generated_scenes().size(), 10u);
}

TEST(GeneratedScenes, ThatAreNotKnownAreRefused) {
  if (std::system("python3 -c ''") != 0) GTEST_SKIP() << "skipped: no Python 3";
  const fs::path folder = fs::path(testing::TempDir()) / "helio_generated_none";
  const auto refused = generate_scene(folder, "no-such-scene");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::failed_precondition);
  EXPECT_NE(refused.error().to_string().find("no-such-scene"), std::string::npos);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace helio::bench
