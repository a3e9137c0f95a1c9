// Every glTF file beside the repository loads and looks as it did when somebody last looked at its picture, or is
// refused for the reason in the table (feature_expectations.json, whose "about" says what its fields are).
//
// HELIO_WRITE_EXPECTATIONS=PATH compares nothing and writes the table as it is now; what a person wrote in its rows
// stays. Look at the pictures of the rows that changed before committing it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "renderer/film/estimate/resolve.h"
#include "renderer/scene/load/scene_loader.h"
#include "tests/support/shared_data.h"
#include "tests/support/test_scenes.h"

namespace helio::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kSide = 48;
constexpr std::uint32_t kSamplesPerHalf = 4;
const std::string kTable = std::string(HELIO_SOURCE_DIR) + "/tests/image/feature_expectations.json";

// What a picture is reduced to.
struct Look {
  double coverage = 0;  // share of camera rays that hit something
  V3d albedo{0, 0, 0};  // mean over all camera rays, 0 for those that hit nothing
  V3d radiance{0, 0, 0}, radiance_error{0, 0, 0};
};

struct Outcome {
  std::string error;  // empty: it loaded
  Look look;
};

Look look_at_scene(const RenderScene& scene, const std::string& name) {
  TraceStats stats;
  const Film film =
      render(scene, camera_pose(scene.description().cameras.at(0)), kSide, kSide, kSamplesPerHalf, {}, &stats);
  EXPECT_EQ(stats.invalid_samples, 0u) << name;
  Look look;
  double samples = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const PixelFeatures& features = film.features(x, y);
      samples += features.count;
      look.coverage += features.hits;
      for (int c = 0; c < 3; ++c) look.albedo[c] += double(features.albedo[c]) * features.count;
    }
  }
  look.coverage /= samples;
  look.albedo /= samples;
  const MeanEstimate mean = mean_of(film);
  look.radiance = mean.mean;
  look.radiance_error = mean.standard_error;
  return look;
}

Outcome try_file(const fs::path& root, const std::string& name, const std::string& environment) {
  const auto folder = make_directory_source((root / name).parent_path().string());
  const auto maps = make_directory_source(root.string());
  SceneLoadOptions options;
  options.environment = environment;
  options.environment_source = maps.get();
  Result<SceneDescription> description = load_scene(*folder, fs::path(name).filename().string(), options);
  if (!description) return {description.error().to_string(), {}};
  const std::shared_ptr<const RenderScene> scene = build(std::move(*description));
  return scene ? Outcome{{}, look_at_scene(*scene, name)} : Outcome{"the scene cannot be built", {}};
}

// Standard errors by which two mean radiances may differ, besides a fiftieth.
//
// Rendering is deterministic; what another version of a library may move is the odd ray that passes the other side of
// an edge and the odd path that goes another way. Rounded vertices move every path.
constexpr double kAgain = 1, kTwin = 4;

void expect_same(const Look& found, const Look& expected, double standard_errors) {
  EXPECT_NEAR(found.coverage, expected.coverage, 0.002);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(found.albedo[c], expected.albedo[c], std::max(0.01 * expected.albedo[c], 0.002)) << "channel " << c;
    EXPECT_NEAR(found.radiance[c], expected.radiance[c],
                0.02 * expected.radiance[c] + standard_errors * found.radiance_error[c])
        << "channel " << c;
  }
}

V3d to_vector(const Json& array) {
  return {array.at(0), array.at(1), array.at(2)};
}

void compare(const Outcome& outcome, const Json& row) {
  if (row.contains("refused")) {
    EXPECT_NE(outcome.error, "");
    for (const std::string word : row["refused"])
      EXPECT_NE(outcome.error.find(word), std::string::npos) << outcome.error;
    return;
  }
  ASSERT_EQ(outcome.error, "");
  Look expected;
  expected.coverage = row.at("coverage");
  expected.albedo = to_vector(row.at("albedo"));
  expected.radiance = to_vector(row.at("radiance"));
  expect_same(outcome.look, expected, kAgain);
}

// Four decimals: well below what is allowed.
double rounded(double value) {
  return std::round(value * 1e4) / 1e4;
}

// The row of the old table with its measurements replaced.
Json measured_row(const Outcome& outcome, Json row) {
  for (const char* key : {"coverage", "albedo", "radiance"}) row.erase(key);
  if (!outcome.error.empty()) {
    if (!row.contains("refused")) row["refused"] = {outcome.error};
    return row;
  }
  row.erase("refused");
  const Look& look = outcome.look;
  row["coverage"] = rounded(look.coverage);
  row["albedo"] = {rounded(look.albedo.x), rounded(look.albedo.y), rounded(look.albedo.z)};
  row["radiance"] = {rounded(look.radiance.x), rounded(look.radiance.y), rounded(look.radiance.z)};
  return row;
}

std::set<std::string> gltf_files(const fs::path& root, const std::set<std::string>& folders) {
  std::set<std::string> names;
  for (const std::string& folder : folders) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() == ".gltf" || entry.path().extension() == ".glb")
        names.insert(fs::relative(entry.path(), root).generic_string());
    }
  }
  return names;
}

// One row a line, so that differences can be read.
void write_table(const std::string& path, const Json& document) {
  std::ofstream file(path);
  file << "{\n\"about\": " << document["about"].dump(2) << ",\n\"files\": {";
  const char* separator = "\n";
  for (const auto& [name, row] : document["files"].items()) {
    file << separator << Json(name).dump() << ": " << row.dump();
    separator = ",\n";
  }
  file << "\n}\n}\n";
  EXPECT_TRUE(file.good()) << path;
}

void walk(const fs::path& root, const std::set<std::string>& folders) {
  const char* write = std::getenv("HELIO_WRITE_EXPECTATIONS");
  Json document = Json::parse(std::ifstream(write && fs::exists(write) ? std::string(write) : kTable));
  Json& rows = document["files"];
  std::map<std::string, Look> looks;
  for (const std::string& name : gltf_files(root, folders)) {
    SCOPED_TRACE(name);
    const Json row = rows.contains(name) ? rows[name] : Json::object();
    const Outcome outcome = try_file(root, name, row.value("environment", ""));
    if (outcome.error.empty()) looks[name] = outcome.look;
    if (write)
      rows[name] = measured_row(outcome, row);
    else if (row.empty())
      ADD_FAILURE() << "not in the table";
    else
      compare(outcome, row);
  }
  if (write) return write_table(write, document);
  for (const auto& [name, row] : rows.items()) {
    SCOPED_TRACE(name);
    if (!folders.count(name.substr(0, name.find('/')))) continue;
    if (!row.contains("refused") && !looks.count(name)) ADD_FAILURE() << "only in the table, or refused";
    if (row.contains("same_as")) expect_same(looks[name], looks[row["same_as"]], kTwin);
  }
}

TEST(FeatureWalk, Features) {
  HELIO_SHARED_OR_SKIP(root, "scenes");
  walk(root, {"gltf-features"});
}

TEST(FeatureWalk, VariantsAndWholeScenes) {
  HELIO_SHARED_OR_SKIP(root, "scenes");
  walk(root, {"glb", "gltf-variants"});
}

}  // namespace
}  // namespace helio::test
