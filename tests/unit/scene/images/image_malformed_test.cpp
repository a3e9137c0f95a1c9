// A walk over broken and good images made by others: every one is decoded to the pixels that its reference says, or
// refused with its name and a reason.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "renderer/scene/images/image_decoder.h"
#include "tests/support/shared_data.h"

namespace helio {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kLimit = 256 << 20;

bool is_image(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".png" || extension == ".exr" || extension == ".pgm" || extension == ".ppm";
}

// 32-bit FNV-1a over the texels, the more significant byte of each only: how the reference was made.
std::uint32_t hash_of(const Image& image) {
  const std::size_t step = image.format == TexelFormat::u16 ? 2 : 1;
  std::uint32_t hash = 0x811c9dc5u;
  for (std::size_t i = step - 1; i < image.texels.size(); i += step) hash = (hash ^ image.texels[i]) * 0x01000193u;
  return hash;
}

struct Reference {
  int width = 0, height = 0, channels = 0;
  bool error = false;
  std::uint32_t hash = 0;
};

std::map<std::string, Reference> read_references(const fs::path& csv) {
  std::map<std::string, Reference> references;
  std::ifstream file(csv);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream row(line);
    std::string name, width, height, channels, error, hash;
    std::getline(row, name, ',');
    std::getline(row, width, ',');
    std::getline(row, height, ',');
    std::getline(row, channels, ',');
    std::getline(row, error, ',');
    std::getline(row, hash, ',');
    references[name] = {std::stoi(width), std::stoi(height), std::stoi(channels), !error.empty(),
                        std::uint32_t(std::stoul(hash, nullptr, 16))};
  }
  return references;
}

TEST(ImageMalformed, EveryFileDecodesOrSaysWhyNot) {
  HELIO_SHARED_OR_SKIP(root, "scenes/images-malformed");
  int decoded = 0, refused = 0;
  testing::internal::CaptureStderr();
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (!entry.is_regular_file() || !is_image(entry.path())) continue;
    const std::string name = fs::relative(entry.path(), root).generic_string();
    const Result<Image> image = decode_image(test::read_bytes(entry.path()), name, kLimit);
    if (image) {
      ++decoded;
      EXPECT_GT(image->bytes(), 0u) << name;
      EXPECT_LE(image->bytes(), kLimit) << name;
    } else {
      ++refused;
      EXPECT_EQ(image.error().where, name);
      EXPECT_FALSE(image.error().message.empty()) << name;
      EXPECT_EQ(image.error().message.find('\n'), std::string::npos) << name;
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "a library talks to the user";
  // 26 EXR, 139 PNG and 4 PNM files; what is refused is listed by kind below.
  EXPECT_GE(decoded, 100);
  EXPECT_GE(refused, 20);
}

TEST(ImageMalformed, PngSuiteDecodesToItsReferencePixels) {
  HELIO_SHARED_OR_SKIP(root, "scenes/images-malformed/png");
  const std::map<std::string, Reference> references = read_references(root / "pngsuite/ref_results.csv");
  ASSERT_GT(references.size(), 200u);
  int compared = 0;
  for (const auto& entry : fs::recursive_directory_iterator(root / "pngsuite")) {
    if (entry.path().extension() != ".png") continue;
    const std::string name = fs::relative(entry.path(), root).generic_string();
    const auto reference = references.find(name);
    if (reference == references.end()) continue;
    const Result<Image> image = decode_image(test::read_bytes(entry.path()), name, kLimit);
    // The reference's decoder also reads what Xcode makes of PNGs; for us that is another format.
    if (name.find("iphone_") != std::string::npos) {
      ASSERT_FALSE(image.ok()) << name;
      EXPECT_NE(image.error().message.find("CgBI"), std::string::npos) << image.error().message;
      continue;
    }
    ++compared;
    EXPECT_EQ(image.ok(), !reference->second.error) << name;
    if (!image || reference->second.error) continue;
    EXPECT_EQ(image->width, reference->second.width) << name;
    EXPECT_EQ(image->height, reference->second.height) << name;
    EXPECT_EQ(image->channels, reference->second.channels) << name;
    EXPECT_EQ(hash_of(*image), reference->second.hash) << name;
  }
  EXPECT_GT(compared, 130);
}

TEST(ImageMalformed, SixteenBitPgmKeepsItsSamples) {
  HELIO_SHARED_OR_SKIP(path, "scenes/images-malformed/png/pbm/basi0g16.pgm");
  const std::vector<std::uint8_t> bytes = test::read_bytes(path);
  const Result<Image> image = decode_image(bytes, "basi0g16.pgm", kLimit);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  ASSERT_EQ(image->format, TexelFormat::u16);
  ASSERT_EQ(image->texels.size(), 32u * 32u * 2u);
  // Samples are the file's last 2048 bytes, big-endian.
  const std::uint8_t* samples = bytes.data() + bytes.size() - 2048;
  for (std::size_t i = 0; i < 1024; ++i) {
    const int wanted = samples[2 * i] << 8 | samples[2 * i + 1];
    const int found = image->texels[2 * i] | image->texels[2 * i + 1] << 8;
    EXPECT_NEAR(found, wanted, 1) << i;  // OpenImageIO 2.4 scales by the file's maximum and truncates
  }
}

TEST(ImageMalformed, ExrFilesAreRefusedForTheirOwnReason) {
  HELIO_SHARED_OR_SKIP(root, "scenes/images-malformed/openexr");
  const std::pair<const char*, const char*> cases[] = {
      {"test_images/64.deep.exr", "deep"},
      {"test_images/Flowers.exr", "ubsampled"},  // said by OpenImageIO 2.4, or by us where that converts it
      {"OpenEXRTest/comp_bad_bounds_piz.exr", "header"},
      {"OpenEXRTest/invalid.exr", "format"},
      {"OpenEXRTest/invalid_shared_attrs_multipart.exr", "shared attributes"},
      {"OpenEXRTest/v1.7.test.interleaved.exr", "R, Z"},
  };
  for (const auto& [name, reason] : cases) {
    const Result<Image> image = decode_image(test::read_bytes(root / name), name, kLimit);
    ASSERT_FALSE(image.ok()) << name;
    EXPECT_NE(image.error().message.find(reason), std::string::npos) << name << ": " << image.error().message;
  }
  for (const char* name : {"test_images/GammaChart.exr", "OpenEXRTest/comp_dwaa_v1.exr", "OpenEXRTest/test_native1.exr",
                           "OpenEXRTest/lineOrder_decreasing.exr"}) {
    const Result<Image> image = decode_image(test::read_bytes(root / name), name, kLimit);
    EXPECT_TRUE(image.ok()) << name << ": " << image.error().to_string();
  }
}

}  // namespace
}  // namespace helio
