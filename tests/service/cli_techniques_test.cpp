#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "cli_test.h"
#include "renderer/codec/tile_codec.h"
#include "renderer/scene/images/image_decoder.h"

namespace helio::test {
namespace {

constexpr std::uint64_t kMaxPixels = 1 << 20;
const std::string kScene = std::string(HELIO_SOURCE_DIR) + "/scenes/cornell-spheres/cornell-spheres.gltf";

class CliTechniques : public CliTest {
 protected:
  // R, G, B one after the other.
  std::vector<float> planes(const std::string& name) {
    const auto picture = read_exr(folder_ / name, kMaxPixels);
    if (!picture) {
      ADD_FAILURE() << name << ": " << picture.error().to_string();
      return {};
    }
    std::vector<float> all;
    for (const char* channel : {"R", "G", "B"}) {
      const auto* plane = picture->find(channel);
      if (plane) all.insert(all.end(), plane->begin(), plane->end());
    }
    EXPECT_EQ(all.size(), 3u * 24 * 20);
    return all;
  }
};

TEST_F(CliTechniques, PicturesAddUpToThatOfRender) {
  const std::vector<std::string> picture = {kScene, "--size", "24x20", "--samples", "4", "--seed", "3"};
  std::vector<std::string> line = {"techniques", "--max-length", "3", "--output", "shown/"};
  line.insert(line.begin() + 1, picture.begin(), picture.end());
  const auto json = heliograph_json(line);
  ASSERT_EQ(json["techniques"].size(), 8u) << "1 of one segment, 3 of two, 4 of three";
  EXPECT_EQ(json["partial"], false);
  EXPECT_EQ(json["samples"], 4);

  std::vector<float> sum(3 * 24 * 20, 0.0f);
  double shares = 0;
  std::set<std::pair<int, int>> seen;
  for (const auto& technique : json["techniques"]) {
    const int s = technique["light_vertices"], t = technique["camera_vertices"];
    EXPECT_EQ(technique["segments"], s + t - 1);
    seen.insert({s, t});
    shares += technique["share"].get<double>();
    const std::vector<float> weighted = planes(technique["output"]);
    ASSERT_EQ(weighted.size(), sum.size());
    for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += weighted[p];
  }
  EXPECT_EQ(seen, (std::set<std::pair<int, int>>{{0, 2}, {0, 3}, {1, 2}, {2, 1}, {0, 4}, {1, 3}, {2, 2}, {3, 1}}));
  EXPECT_NEAR(shares, 1, 1e-9);
  EXPECT_EQ(json["techniques"][3]["output"], "shown/s02-t01.exr");
  EXPECT_EQ(json["exposure_stops"].size(), 3u);

  line = {"render", "--integrator", "bdpt", "--max-segments", "3", "--output", "all.exr"};
  line.insert(line.begin() + 1, picture.begin(), picture.end());
  heliograph_json(line);
  const std::vector<float> all = planes("all.exr");
  for (std::size_t p = 0; p < all.size(); ++p) EXPECT_NEAR(sum[p], all[p], 1e-5f + 1e-5f * all[p]) << p;

  line.insert(line.end(), {"--technique", "2,1", "--output", "one.exr"});
  line.erase(std::find(line.begin(), line.end(), "all.exr") - 1, std::find(line.begin(), line.end(), "all.exr") + 1);
  heliograph_json(line);
  EXPECT_EQ(planes("one.exr"), planes("shown/s02-t01.exr"));

  // Rows of 1, 3 and 4 copies of 24x20 pixels, 4 apart.
  const std::string bytes = read_file(folder_ / json["weighted_png"].get<std::string>());
  const auto sheet =
      decode_image({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, "weighted", 1u << 24);
  ASSERT_TRUE(sheet) << sheet.error().to_string();
  EXPECT_EQ(sheet->width, 4 * 28 + 4);
  EXPECT_EQ(sheet->height, 3 * 24 + 4);
}

TEST_F(CliTechniques, TheTableNamesEachOnce) {
  const ProcessResult result =
      heliograph({"techniques", kScene, "--size", "16x16", "--samples", "2", "--max-length", "2", "--output", "here"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1 + 4 + 1 + 1) << result.out;
  EXPECT_EQ(result.out.find("unweighted"), std::string::npos);
  EXPECT_NE(result.out.find("here/weighted.png"), std::string::npos);
}

// A picture would fall on the scene by way of a link.
TEST_F(CliTechniques, NothingThatIsReadIsOverwritten) {
  std::filesystem::rename(folder_ / "quad.gltf", folder_ / "s00-t02.exr.gltf");
  std::filesystem::create_symlink("s00-t02.exr.gltf", folder_ / "s00-t02.exr");
  const ProcessResult result = heliograph({"techniques", "s00-t02.exr.gltf", "--output", "."});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("is the scene, which must not be overwritten"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace helio::test
