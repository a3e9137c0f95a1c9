#include "renderer/codec/display_image.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <set>

#include "renderer/base/srgb.h"
#include "renderer/codec/jpeg_file.h"
#include "renderer/codec/srgb_bytes.h"
#include "tests/unit/picture/temporary_folder.h"

namespace helio {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct ReadPng {
  int width = 0, height = 0, channels = 0;
  std::string description;
  std::vector<std::uint8_t> bytes;
};

ReadPng read_png(const std::string& path) {
  ReadPng png;
  const auto in = OIIO::ImageInput::open(path);
  if (!in) return png;
  const OIIO::ImageSpec spec = in->spec();
  png.width = spec.width;
  png.height = spec.height;
  png.channels = spec.nchannels;
  png.description = spec.get_string_attribute("ImageDescription");
  png.bytes.resize(std::size_t(spec.width) * std::size_t(spec.height) * std::size_t(spec.nchannels));
  EXPECT_TRUE(in->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::UINT8, png.bytes.data()));
  return png;
}

PictureView grey(const std::vector<float>& v, int width, int height) {
  return {width, height, {v.data(), v.data(), v.data()}};
}

TEST(AutoExposure, BringsTheLogAverageToMiddleGrey) {
  // Luminances 0.1 and 10: log-average 1, so the factor is 0.18. Black, NaN and infinite pixels do not count.
  const std::vector<float> v{0.1f, 10.0f, 0.0f, kNan, kInfinity, -1.0f};
  EXPECT_NEAR(auto_exposure(grey(v, 6, 1)), 0.18, 1e-6);
  // 1e-6 of the mean is dust, not picture.
  EXPECT_NEAR(auto_exposure(grey({1, 1, 1e-6f}, 3, 1)), 0.18, 1e-6);
  EXPECT_EQ(auto_exposure(grey({0, 0}, 2, 1)), 1.0);
  EXPECT_EQ(auto_exposure(grey({kNan}, 1, 1)), 1.0);
  EXPECT_EQ(auto_exposure(grey({1e-30f}, 1, 1)), 0x1p40);
  EXPECT_GT(auto_exposure(grey({3e38f, 3e38f}, 2, 1)), 0.0);
}

TEST(SrgbByte, IsTheRoundedTransferFunctionOfEveryFloat) {
  const auto expect = [](float x) { ASSERT_EQ(srgb_byte(x), std::uint8_t(std::lround(255.0f * encode_srgb(x)))) << x; };
  // Every 997th float from 0 to 2, and both sides of each step of the byte.
  for (std::uint32_t bits = 0; bits <= std::bit_cast<std::uint32_t>(2.0f); bits += 997)
    expect(std::bit_cast<float>(bits));
  for (int byte = 0; byte < 255; ++byte) {
    std::uint32_t low = 0, high = std::bit_cast<std::uint32_t>(1.0f);
    while (high - low > 1) {
      const std::uint32_t middle = low + (high - low) / 2;
      (srgb_byte(std::bit_cast<float>(middle)) <= byte ? low : high) = middle;
    }
    expect(std::bit_cast<float>(low));
    expect(std::bit_cast<float>(high));
    EXPECT_EQ(srgb_byte(std::bit_cast<float>(high)), byte + 1);
  }
  for (const float x : {-0.0f, -1.0f, 1e-45f, 3e38f, kInfinity, -kInfinity, kNan}) expect(x);
}

TEST(Jpeg, ShowsThePixels) {
  // A grey that rises from left to right; 4:2:0 and quality 95 leave it nearly as it is.
  constexpr int kWidth = 37, kHeight = 21;
  std::vector<std::uint8_t> rgb;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) rgb.insert(rgb.end(), 3, std::uint8_t(6 * x));
  }
  const auto jpeg = encode_jpeg(kWidth, kHeight, rgb, 95);
  ASSERT_TRUE(jpeg.ok()) << jpeg.error().to_string();
  EXPECT_LT(encode_jpeg(kWidth, kHeight, rgb, 10)->size(), jpeg->size());
  OIIO::Filesystem::IOMemReader memory(const_cast<std::uint8_t*>(jpeg->data()), jpeg->size());
  const auto in = OIIO::ImageInput::open("p.jpg", nullptr, &memory);
  ASSERT_TRUE(in) << OIIO::geterror();
  ASSERT_EQ(in->spec().width, kWidth);
  ASSERT_EQ(in->spec().height, kHeight);
  ASSERT_EQ(in->spec().nchannels, 3);
  std::vector<std::uint8_t> shown(rgb.size());
  ASSERT_TRUE(in->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT8, shown.data()));
  for (std::size_t i = 0; i < rgb.size(); ++i) ASSERT_NEAR(shown[i], rgb[i], 8) << i;
}

TEST(Jpeg, RefusesWhatItCannotWrite) {
  const std::vector<std::uint8_t> rgb(12);
  EXPECT_EQ(encode_jpeg(2, 2, rgb, 0).error().message, "quality 0; allowed: [1, 100]");
  EXPECT_EQ(encode_jpeg(2, 2, rgb, 101).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(encode_jpeg(3, 2, rgb, 50).error().message, "the pixels do not fill the picture");
  EXPECT_EQ(encode_jpeg(65501, 1, rgb, 50).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(encode_jpeg(0, 1, {}, 50).error().code, ErrorCode::invalid_argument);
}

TEST(DisplayPng, EncodesSrgb) {
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "p.png").string();
  // IEC 61966-2-1: 0.2158605 is encoded as 128/255, 0.0031308 as 0.04045, 0.18 as 0.4613561.
  const std::vector<float> r{0.2158605f, 1.0f, -1.0f, kInfinity}, g{0.0031308f, 0.18f, kNan, 0.0f},
      b{0, 2.0f, 0.5f, 1e9f};
  const PictureView picture{2, 2, {r.data(), g.data(), b.data()}};
  ASSERT_TRUE(write_display_png(path, picture, 1.0).ok());
  const ReadPng png = read_png(path);
  ASSERT_EQ(png.width, 2);
  ASSERT_EQ(png.height, 2);
  ASSERT_EQ(png.channels, 3);
  const std::vector<std::uint8_t> expected{128, 10, 0, 255, 118, 255, 0, 0, 188, 255, 0, 255};
  EXPECT_EQ(png.bytes, expected);
  ASSERT_TRUE(write_display_png(path, picture, 0.5).ok());
  EXPECT_EQ(read_png(path).bytes[3], 188) << "0.5 is encoded as 0.7354";
}

TEST(DisplayPng, FailuresAreErrors) {
  const test::TemporaryFolder folder;
  const std::vector<float> v{1};
  EXPECT_FALSE(write_display_png((folder.path() / "no/p.png").string(), grey(v, 1, 1), 1).ok());
  EXPECT_FALSE(write_display_png((folder.path() / "p.png").string(), grey(v, 0, 1), 1).ok());
  EXPECT_FALSE(write_display_png((folder.path() / "p.png").string(), grey(v, -1, -1), 1).ok());
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

// CIE lightness is independent of the OkLab that the map is made in.
double cie_lightness(const Rgb& c) {
  const double y = luminance(c);
  return y > 0.008856 ? 116 * std::cbrt(y) - 16 : 903.3 * y;
}

TEST(HeatColor, RisesEvenlyInLightnessInsideTheGamut) {
  double last = cie_lightness(heat_color(0.0f));
  EXPECT_LT(last, 5);
  for (int i = 1; i <= 100; ++i) {
    const Rgb c = heat_color(float(i) / 100);
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(c[k], 0.0f) << i;
      EXPECT_LE(c[k], 1.0f) << i;
    }
    const double lightness = cie_lightness(c);
    EXPECT_GT(lightness - last, 0.2) << "step " << i;
    EXPECT_LT(lightness - last, 2.2) << "step " << i;
    last = lightness;
  }
  EXPECT_GT(last, 93);
  EXPECT_EQ(heat_color(-1), heat_color(0));
  EXPECT_EQ(heat_color(2), heat_color(1));
  EXPECT_EQ(heat_color(kNan), Rgb(0, 1, 0));
}

TEST(HeatRange, PlacesValuesAndSaysWhatItIs) {
  const HeatRange logarithmic{1e-4f, 1, true};
  EXPECT_NEAR(logarithmic.position(1e-2f), 0.5, 1e-5);
  for (const float low : {-1.0f, 0.0f, 1e-45f, 1e-4f}) EXPECT_EQ(logarithmic.position(low), 0.0f) << low;
  for (const float high : {1.0f, 1e9f, kInfinity}) EXPECT_EQ(logarithmic.position(high), 1.0f) << high;
  EXPECT_TRUE(std::isnan(logarithmic.position(kNan)));
  EXPECT_EQ(logarithmic.describe(), "1.0e-04 to 1.0e+00, logarithmic");
  const HeatRange linear{-1, 3, false};
  EXPECT_NEAR(linear.position(1), 0.5, 1e-6);
  EXPECT_EQ(linear.position(-kInfinity), 0.0f);
  EXPECT_EQ(linear.position(kInfinity), 1.0f);
  EXPECT_TRUE(std::isnan(linear.position(kNan)));
}

TEST(HeatMap, WritesARampWithItsRange) {
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "heat.png").string();
  std::vector<float> values(256);
  for (int i = 0; i < 256; ++i) values[std::size_t(i)] = float(i) / 255;
  values[7] = kNan;
  ASSERT_TRUE(write_heat_map_png(path, 256, 1, values.data(), {0, 1, false}, "Share").ok());
  const ReadPng png = read_png(path);
  ASSERT_EQ(png.bytes.size(), 256u * 3);
  EXPECT_NE(png.description.find("Share, 0.0e+00 to 1.0e+00, linear"), std::string::npos) << png.description;
  EXPECT_EQ(png.bytes[21], 0);
  EXPECT_EQ(png.bytes[22], 255);
  EXPECT_EQ(png.bytes[23], 0);
  std::set<std::array<std::uint8_t, 3>> colors;
  for (std::size_t i = 0; i < 256; ++i) colors.insert({png.bytes[3 * i], png.bytes[3 * i + 1], png.bytes[3 * i + 2]});
  EXPECT_GT(colors.size(), 240u) << "a ramp that can be read";
}

}  // namespace
}  // namespace helio
