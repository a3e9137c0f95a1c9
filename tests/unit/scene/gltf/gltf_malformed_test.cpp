// The Khronos validator's own test files, each beside the validator's report: what it calls an error is refused by a
// strict load with a place, what it calls valid loads. There is no list of exceptions. Without `strict` nothing else is
// refused, and what loads of the errors has slips in its report.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "renderer/scene/load/scene_loader.h"
#include "tests/support/shared_data.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;

TEST(GltfMalformed, AgreesWithTheValidator) {
  HELIO_SHARED_OR_SKIP(root, "scenes/gltf-malformed/validator");
  int files = 0, refused = 0, tolerated = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root)) {
    const fs::path& path = entry.path();
    if (path.extension() != ".gltf" && path.extension() != ".glb") continue;
    const std::vector<std::uint8_t> text = read_bytes(path.string() + ".report.json");
    const nlohmann::json report = nlohmann::json::parse(text.begin(), text.end());
    const bool valid = report["issues"]["numErrors"].get<int>() == 0;
    const std::string name = fs::relative(path, root).generic_string(), file = path.filename().string();

    const auto source = make_directory_source(path.parent_path().string());
    SceneLoadOptions strict;
    strict.strict = true;
    const Result<SceneDescription> scene = load_scene(*source, file, strict), lenient = load_scene(*source, file, {});
    EXPECT_TRUE(lenient.ok() || !scene.ok()) << name;
    if (lenient.ok()) {
      EXPECT_EQ(lenient->report.slips > 0, !scene.ok()) << name;
      tolerated += !scene.ok();
    }
    ++files;
    refused += !scene.ok();
    EXPECT_EQ(scene.ok(), valid) << name << "\n  loader: " << (scene.ok() ? "loads" : scene.error().to_string())
                                 << "\n  report: " << report["issues"]["messages"].dump();
    if (scene.ok()) continue;
    // A clear error: the file, a JSON pointer or a byte in it, and a sentence.
    const std::string& where = scene.error().where;
    ASSERT_TRUE(where.starts_with(file)) << name << ": " << scene.error().to_string();
    const bool whole_file = report["issues"]["messages"][0].value("code", "") == "TYPE_MISMATCH" && where == file;
    EXPECT_TRUE(whole_file || where[file.size()] == '/' || where[file.size()] == '@') << name << ": " << where;
    EXPECT_GE(scene.error().message.size(), 10u) << name;
  }
  EXPECT_GT(files, 150);
  EXPECT_GT(refused, 100);
  EXPECT_GT(tolerated, 10);
  EXPECT_GT(refused - tolerated, 60);
}

}  // namespace
}  // namespace helio::test
