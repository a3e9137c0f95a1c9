// A tile is a file that other people's tools read: the ones of OpenEXR and OpenImageIO here (Debian packages openexr
// and openimageio-tools; deploy/install-deps.sh installs them).
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "tests/support/shared_data.h"
#include "tests/unit/picture/temporary_folder.h"
#include "tests/unit/picture/tile_pictures.h"

namespace helio {
namespace {

using test::NoiseTile;

bool installed(const std::string& tool) {
  return std::system(("command -v " + tool + " >/dev/null 2>&1").c_str()) == 0;
}

struct Output {
  int exit_code = -1;
  std::string text;
};

Output run(const std::string& command) {
  Output output;
  std::FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return output;
  char buffer[4096];
  while (const std::size_t n = std::fread(buffer, 1, sizeof(buffer), pipe)) output.text.append(buffer, n);
  output.exit_code = pclose(pipe);
  return output;
}

class ExrTools : public ::testing::TestWithParam<TileCompression> {
 protected:
  // 70 x 40 pixels at (60, 300) of a 640 x 360 frame.
  std::string write_tile() {
    const NoiseTile tile({60, 300, 130, 340}, 640, 360);
    const std::vector<std::uint8_t> bytes = test::encode_or_die(tile, {TilePixelType::half, GetParam()});
    const std::string path = (folder_.path() / "tile.exr").string();
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    return path;
  }

 private:
  test::TemporaryFolder folder_;
};

#define HELIO_TOOL_OR_SKIP(tool)                                                    \
  if (!installed(tool)) {                                                           \
    if (test::shared_required()) FAIL() << tool << " is not installed and CI=true"; \
    GTEST_SKIP() << "skipped: " << tool << " is not installed";                     \
  }                                                                                 \
  static_assert(true, "")

TEST_P(ExrTools, ExrheaderReadsATile) {
  HELIO_TOOL_OR_SKIP("exrheader");
  const Output output = run("exrheader " + write_tile());
  EXPECT_EQ(output.exit_code, 0) << output.text;
  for (const char* expected : {"dataWindow (type box2i): (60 300) - (129 339)",
                               "displayWindow (type box2i): (0 0) - (639 359)", "variance.R, 16-bit floating-point",
                               "samples, 16-bit floating-point", "software (type string): \"Heliograph"}) {
    EXPECT_NE(output.text.find(expected), std::string::npos) << expected << " is not in\n" << output.text;
  }
}

TEST_P(ExrTools, OiiotoolReadsATile) {
  HELIO_TOOL_OR_SKIP("oiiotool");
  const Output output = run("oiiotool --info -v --stats " + write_tile());
  EXPECT_EQ(output.exit_code, 0) << output.text;
  for (const char* expected : {"70 x   40", "7 channel", "variance.R", "x=60, y=300"}) {
    EXPECT_NE(output.text.find(expected), std::string::npos) << expected << " is not in\n" << output.text;
  }
}

std::string compression_name(const ::testing::TestParamInfo<TileCompression>& info) {
  static const char* names[] = {"none", "rle", "zips", "zip", "piz", "dwaa"};
  return names[int(info.param)];
}
INSTANTIATE_TEST_SUITE_P(AllCompressions, ExrTools, ::testing::ValuesIn(test::kCompressions), compression_name);

}  // namespace
}  // namespace helio
