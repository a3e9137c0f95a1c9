// What is sent of a tile: read in place where it is not compressed, by OpenEXR elsewhere, and the same either way.
#include "client/tev/tev_tile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "client/tev/uncompressed_exr.h"
#include "renderer/codec/tile_codec.h"

namespace helio::test {
namespace {

constexpr PixelRect kWindow{16, 8, 29, 15};
const std::vector<std::string> kChannels{"R", "G", "B", "error", "samples"};

std::string make_exr(const TileEncoding& encoding, bool with_variance = true) {
  const std::vector<std::string> names =
      with_variance ? std::vector<std::string>{"R", "G", "B", "variance.R", "variance.G", "variance.B", "samples"}
                    : std::vector<std::string>{"R", "G", "B", "samples"};
  std::vector<std::vector<float>> planes;
  std::vector<TileChannel> channels;
  for (std::size_t c = 0; c < names.size(); ++c) {
    std::vector<float>& plane = planes.emplace_back();
    for (std::int64_t i = 0; i < kWindow.area(); ++i) plane.push_back(float(c + 1) * 0.25f + float(i) * 0.5f);
  }
  for (std::size_t c = 0; c < names.size(); ++c)
    channels.push_back({names[c], planes[c].data(), names[c] == "samples"});
  const auto bytes = encode_tile({kWindow, 40, 30}, channels, encoding).value();
  return {bytes.begin(), bytes.end()};
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

TEST(TevTile, HasRadianceErrorAndSamplesInEveryEncoding) {
  const TileEncoding encodings[] = {{TilePixelType::float32, TileCompression::none},
                                    {TilePixelType::half, TileCompression::none},
                                    {TilePixelType::float32, TileCompression::zip},
                                    {TilePixelType::half, TileCompression::piz}};
  for (const TileEncoding& encoding : encodings) {
    const std::string exr = make_exr(encoding);
    EXPECT_EQ(UncompressedExr::open(bytes_of(exr)).ok(), encoding.compression == TileCompression::none);
    std::vector<float> planes;
    const Status read = read_tev_tile(exr, kWindow, kChannels, planes);
    ASSERT_TRUE(read) << read.error().to_string();
    const std::size_t area = std::size_t(kWindow.area());
    ASSERT_EQ(planes.size(), kChannels.size() * area);
    for (std::size_t i = 0; i < area; ++i) {
      // The numbers are multiples of 1/4 below 64, which halves hold exactly.
      const float step = float(i) * 0.5f;
      EXPECT_EQ(planes[i], 0.25f + step);
      EXPECT_EQ(planes[area + i], 0.5f + step);
      EXPECT_EQ(planes[2 * area + i], 0.75f + step);
      // Variances 1, 1.25 and 1.5, and the step: their mean is 1.25 and the step.
      EXPECT_FLOAT_EQ(planes[3 * area + i], std::sqrt(1.25f + step));
      EXPECT_EQ(planes[4 * area + i], 1.75f + step);
    }
  }
}

TEST(TevTile, ChannelsFollowTheFormatAndWhatATileLacksIsNotANumber) {
  heliograph::v1::TileFormat format;
  EXPECT_EQ(tev_channels(format), kChannels);
  format.set_display(true);
  format.set_without_variance(true);
  EXPECT_EQ(tev_channels(format),
            (std::vector<std::string>{"R", "G", "B", "display.R", "display.G", "display.B", "samples"}));

  std::vector<float> planes;
  ASSERT_TRUE(read_tev_tile(make_exr({}, false), kWindow, {"error", "R", "display.R"}, planes));
  EXPECT_TRUE(std::isnan(planes[0]));
  EXPECT_EQ(planes[std::size_t(kWindow.area())], 0.25f);
  EXPECT_TRUE(std::isnan(planes[2 * std::size_t(kWindow.area())]));
}

TEST(TevTile, RefusesAnotherWindowAndWhatIsNoExr) {
  std::vector<float> planes;
  const std::string exr = make_exr({});
  EXPECT_FALSE(read_tev_tile(exr, {0, 0, 13, 7}, kChannels, planes));
  EXPECT_FALSE(read_tev_tile("no picture", kWindow, kChannels, planes));
  EXPECT_FALSE(read_tev_tile("", kWindow, kChannels, planes));
}

// Under the address sanitizer this is what it is for.
TEST(UncompressedExr, BearsEveryCutAndEveryBrokenByte) {
  const std::string exr = make_exr({TilePixelType::float32, TileCompression::none});
  ASSERT_TRUE(UncompressedExr::open(bytes_of(exr)));
  for (std::size_t size = 0; size < exr.size(); ++size) {
    const std::vector<std::uint8_t> cut(exr.begin(), exr.begin() + std::ptrdiff_t(size));
    EXPECT_FALSE(UncompressedExr::open(cut)) << size;
  }
  int refused = 0;
  std::vector<std::uint8_t> bytes(exr.begin(), exr.end());
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (const int change : {0x01, 0x80, 0xff}) {
      bytes[at] ^= std::uint8_t(change);
      const auto file = UncompressedExr::open(bytes);
      refused += !file;
      if (file && file->window().width() <= 4096) {
        std::vector<float> row(std::size_t(file->window().width()));
        for (int y = file->window().y0; y < file->window().y1; ++y) file->read_row(0, y, row.data());
      }
      bytes[at] ^= std::uint8_t(change);
    }
  }
  EXPECT_GT(refused, 300);
}

}  // namespace
}  // namespace helio::test
