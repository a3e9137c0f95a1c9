#include "client/report/pictures/png_bytes.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <libdeflate.h>

#include <filesystem>
#include <fstream>

#include "client/report/pictures/difference_maps.h"

namespace helio::report {
namespace {

namespace fs = std::filesystem;

std::vector<std::uint8_t> decoded(const std::vector<std::uint8_t>& png, int width, int height) {
  const fs::path file = fs::path(testing::TempDir()) / "report-picture.png";
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(png.data()), long(png.size()));
  const auto input = OIIO::ImageInput::open(file.string());
  EXPECT_TRUE(input) << OIIO::geterror();
  if (!input) return {};
  EXPECT_EQ(input->spec().width, width);
  EXPECT_EQ(input->spec().height, height);
  std::vector<std::uint8_t> pixels(std::size_t(width) * std::size_t(height) * 3);
  EXPECT_TRUE(input->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT8, pixels.data()));
  return pixels;
}

TEST(PngBytes, OtherReadersSeeThePixels) {
  const int width = 37, height = 23;
  std::vector<std::uint8_t> rgb;
  for (int i = 0; i < width * height * 3; ++i) rgb.push_back(std::uint8_t(i < 900 ? i / 3 : i * i * 31 >> 4));
  EXPECT_EQ(decoded(png_of_rgb(width, height, rgb), width, height), rgb);
  std::vector<std::uint8_t> indices, expected;
  for (int i = 0; i < width * height; ++i) indices.push_back(std::uint8_t(i * 7));
  for (const std::uint8_t index : indices) {
    for (const std::uint8_t byte : flip_palette()[index]) expected.push_back(byte);
  }
  EXPECT_EQ(decoded(png_of_indices(width, height, indices, flip_palette()), width, height), expected);
}

TEST(ZlibBytes, AreInflatedToTheSame) {
  std::vector<std::uint8_t> bytes(10000), back(bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = std::uint8_t(i * i >> 5);
  const auto packed = zlib_bytes(bytes);
  libdeflate_decompressor* inflater = libdeflate_alloc_decompressor();
  EXPECT_EQ(libdeflate_zlib_decompress(inflater, packed.data(), packed.size(), back.data(), back.size(), nullptr),
            LIBDEFLATE_SUCCESS);
  libdeflate_free_decompressor(inflater);
  EXPECT_EQ(back, bytes);
}

}  // namespace
}  // namespace helio::report
