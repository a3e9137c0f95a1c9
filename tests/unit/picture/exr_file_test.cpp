#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/shared_data.h"
#include "tests/unit/picture/temporary_folder.h"
#include "tests/unit/picture/tile_pictures.h"

namespace helio {
namespace {

namespace fs = std::filesystem;
using test::NoiseTile;

int entries(const fs::path& folder) {
  return int(std::distance(fs::directory_iterator(folder), {}));
}

TEST(ExrFile, RoundTripsAndLeavesNothingBeside) {
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "picture.exr").string();
  const NoiseTile picture({0, 0, 33, 21}, 33, 21);
  for (int round = 0; round < 2; ++round) {  // the second replaces the first
    ASSERT_TRUE(
        write_exr(path, picture.header, picture.channels(), {TilePixelType::float32, TileCompression::zip}).ok());
  }
  EXPECT_EQ(entries(folder.path()), 1);
  const Result<DecodedTile> read = read_exr(path, 33 * 21);
  ASSERT_TRUE(read.ok()) << read.error().to_string();
  EXPECT_EQ(*read->find("variance.G"), picture.values[4]);
  const Result<DecodedTile> refused = read_exr(path, 33 * 21 - 1);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().to_string().find("picture.exr"), std::string::npos);
}

TEST(ExrFile, FailuresNameTheFileAndLeaveTheOldOne) {
  const test::TemporaryFolder folder;
  const NoiseTile picture({0, 0, 4, 4}, 4, 4);
  const Status absent = write_exr((folder.path() / "no/such/p.exr").string(), picture.header, picture.channels(), {});
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().code, ErrorCode::not_found);
  EXPECT_NE(absent.error().to_string().find("p.exr"), std::string::npos);

  const fs::path occupied = folder.path() / "folder.exr";
  fs::create_directory(occupied);
  EXPECT_FALSE(write_exr(occupied.string(), picture.header, picture.channels(), {}).ok());
  EXPECT_EQ(entries(folder.path()), 1) << "the temporary file is gone";

  const NoiseTile part({0, 0, 2, 2}, 4, 4);
  EXPECT_FALSE(write_exr((folder.path() / "part.exr").string(), part.header, part.channels(), {}).ok());
  EXPECT_EQ(read_exr((folder.path() / "none.exr").string(), 16).error().code, ErrorCode::not_found);
  EXPECT_EQ(read_exr(folder.path().string(), 16).error().code, ErrorCode::invalid_argument);
  std::ofstream(folder.path() / "text.exr") << "not a picture";
  EXPECT_EQ(read_exr((folder.path() / "text.exr").string(), 16).error().code, ErrorCode::invalid_argument);
}

// Files made by another renderer, with the mean that their README states.
TEST(ExrFile, ReadsTheReferencesOfTheBenches) {
  HELIO_SHARED_OR_SKIP(root, "scenes/bench");
  struct Case {
    const char* file;
    double mean[3];
  };
  for (const Case& c : {Case{"cornell.reference.exr", {.19684, .12908, .03866}},
                        {"covered.reference.exr", {.06579, .04486, .01438}},
                        {"glass.reference.exr", {.20673, .13761, .04112}}}) {
    const Result<DecodedTile> tile = read_exr((root / c.file).string(), 512 * 512);
    ASSERT_TRUE(tile.ok()) << tile.error().to_string();
    const char* names[3] = {"R", "G", "B"};
    for (int k = 0; k < 3; ++k) {
      const std::vector<float>* channel = tile->find(names[k]);
      ASSERT_NE(channel, nullptr);
      double total = 0;
      for (const float v : *channel) total += v;
      EXPECT_NEAR(total / (512 * 512), c.mean[k], 1e-5) << c.file;
    }
  }
}

}  // namespace
}  // namespace helio
