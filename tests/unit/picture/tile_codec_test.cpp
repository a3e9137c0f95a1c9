#include "renderer/codec/tile_codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/picture/tile_pictures.h"

namespace helio {
namespace {

using test::NoiseTile;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

std::vector<float> round_trip(const std::vector<float>& values, TileChannel channel, const TileEncoding& encoding) {
  const int n = int(values.size());
  channel.name = "R";
  channel.data = values.data();
  const Result<std::vector<std::uint8_t>> bytes = encode_tile({{0, 0, n, 1}, n, 1}, {&channel, 1}, encoding);
  EXPECT_TRUE(bytes.ok());
  const Result<DecodedTile> tile = decode_tile(*bytes, values.size());
  EXPECT_TRUE(tile.ok()) << tile.error().to_string();
  return *tile->find("R");
}

TEST(TileCodec, RoundTripsEveryEncoding) {
  // Widths and heights that are no multiple of any chunk (16 or 32 rows), and the smallest tile.
  for (const PixelRect window : {PixelRect{64, 128, 128, 192}, PixelRect{600, 320, 637, 359}, PixelRect{3, 5, 4, 6}}) {
    const NoiseTile tile(window, 640, 360);
    for (const TileCompression compression : test::kCompressions) {
      for (const TilePixelType type : {TilePixelType::half, TilePixelType::float32}) {
        const std::vector<std::uint8_t> bytes = test::encode_or_die(tile, {type, compression});
        const Result<DecodedTile> decoded = decode_tile(bytes, std::uint64_t(window.area()));
        ASSERT_TRUE(decoded.ok()) << decoded.error().to_string();
        EXPECT_EQ(decoded->header.data_window, window);
        EXPECT_EQ(decoded->header.frame_width, 640);
        EXPECT_EQ(decoded->header.frame_height, 360);
        ASSERT_EQ(decoded->names.size(), tile.names.size());
        for (std::size_t c = 0; c < tile.names.size(); ++c) {
          const std::vector<float>* values = decoded->find(tile.names[c]);
          ASSERT_NE(values, nullptr) << tile.names[c];
          ASSERT_EQ(values->size(), tile.values[c].size());
          for (std::size_t i = 0; i < values->size(); ++i) {
            const float expected = tile.values[c][i], got = (*values)[i];
            if (compression == TileCompression::dwaa) {
              ASSERT_NEAR(got, expected, 1.0f);  // lossy on noise; what matters here is that it is the same picture
            } else if (type == TilePixelType::float32) {
              ASSERT_EQ(got, expected);
            } else {
              ASSERT_NEAR(got, expected, expected * 0x1p-11f + 0x1p-25f);  // half an ulp of half
            }
          }
        }
      }
    }
  }
}

TEST(TileCodec, HalfHasNoInfinityAndKeepsNan) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  // Nine values: the vector path and its remainder.
  const std::vector<float> in{65504, 65520, 1e9f, kInfinity, -1e9f, -kInfinity, nan, 1, 1e9f};
  for (const TileCompression compression : {TileCompression::none, TileCompression::zip}) {
    const std::vector<float> out = round_trip(in, {}, {TilePixelType::half, compression});
    EXPECT_EQ(out[0], 65504);
    for (const int i : {1, 2, 3, 8}) EXPECT_EQ(out[std::size_t(i)], 65504) << i;
    EXPECT_EQ(out[4], -65504);
    EXPECT_EQ(out[5], -65504);
    EXPECT_TRUE(std::isnan(out[6]));
    EXPECT_EQ(out[7], 1);
  }
  const std::vector<float> all_nan = round_trip(std::vector<float>(9, nan), {}, {});
  for (const float v : all_nan) EXPECT_TRUE(std::isnan(v));
}

TEST(TileCodec, AVarianceDoesNotBecomeCertainty) {
  const std::vector<float> in{1e-9f, 1e-30f, 0.0f, -1e-9f, 1e-3f, 0x1p-24f, 2e-45f, 0.0f, 1e-9f};
  TileChannel channel;
  channel.keep_positive = true;
  const std::vector<float> kept = round_trip(in, channel, {});
  for (std::size_t i = 0; i < in.size(); ++i) EXPECT_EQ(kept[i] > 0, in[i] > 0) << i;
  EXPECT_EQ(kept[0], 0x1p-24f);
  EXPECT_NEAR(kept[4], 1e-3f, 1e-6f);
  channel.keep_positive = false;
  EXPECT_EQ(round_trip(in, channel, {})[0], 0.0f) << "radiance is rounded to the nearest";
}

TEST(TileCodec, KeepsFloatChannelsBitForBit) {
  const std::vector<float> in{1e9f, 2049, 1e-30f, kInfinity, 123456.789f};
  TileChannel channel;
  channel.keep_float = true;
  for (const TileCompression compression : {TileCompression::none, TileCompression::zip}) {
    EXPECT_EQ(round_trip(in, channel, {TilePixelType::half, compression}), in);
  }
}

TEST(TileCodec, CommentsAndOriginComeBack) {
  const float value = 1;
  const std::vector<TileChannel> channels{{"R", &value}};
  for (const TileCompression compression : {TileCompression::none, TileCompression::zip}) {
    TileHeader header{{0, 0, 1, 1}, 1, 1};
    for (const std::string& comments : {std::string(), "one\ntwo " + std::string(1000, 'x')}) {
      header.comments = comments;
      header.origin = comments.empty() ? "" : "{\"scene_id\": \"1\"}";
      const auto bytes = encode_tile(header, channels, {TilePixelType::half, compression});
      ASSERT_TRUE(bytes) << bytes.error().to_string();
      const auto decoded = decode_tile(*bytes, 1);
      ASSERT_TRUE(decoded) << decoded.error().to_string();
      EXPECT_EQ(decoded->header.comments, comments);
      EXPECT_EQ(decoded->header.origin, header.origin);
    }
  }
}

TEST(TileCodec, RefusesWhatIsNoTile) {
  const NoiseTile good({0, 0, 4, 4}, 8, 8, {"R"});
  struct Case {
    TileHeader header;
    std::vector<TileChannel> channels;
    const char* expected;
  };
  const float* data = good.values[0].data();
  const Case cases[] = {
      {{{0, 0, 0, 4}, 8, 8}, good.channels(), "data_window"},  {{{4, 4, 9, 8}, 8, 8}, good.channels(), "data_window"},
      {{{-1, 0, 3, 4}, 8, 8}, good.channels(), "data_window"}, {good.header, {}, "channels"},
      {good.header, {{"R", data}, {"R", data}}, "twice"},      {good.header, {{"", data}}, "name"},
      {good.header, {{std::string(256, 'x'), data}}, "name"},  {good.header, {{"R", nullptr}}, "null"},
  };
  for (const Case& c : cases) {
    const auto bytes = encode_tile(c.header, c.channels, {});
    ASSERT_FALSE(bytes.ok()) << c.expected;
    EXPECT_EQ(bytes.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(bytes.error().to_string().find(c.expected), std::string::npos) << bytes.error().to_string();
  }
  const auto both = encode_tile({{0, 0, 0, 4}, 8, 8}, std::vector<TileChannel>{{"R", nullptr}}, {});
  EXPECT_NE(both.error().to_string().find("data_window"), std::string::npos) << "all problems at once";
  EXPECT_NE(both.error().to_string().find("null"), std::string::npos);
}

TEST(TileCodec, TakesLongNamesAndTheFarCorner) {
  const std::string longest(255, 'n');
  const NoiseTile tile({65535, 65535, 65536, 65536}, 65536, 65536, {longest, "albedo.R"});
  for (const TileCompression compression : {TileCompression::none, TileCompression::zips}) {
    const Result<DecodedTile> decoded = decode_tile(test::encode_or_die(tile, {TilePixelType::half, compression}), 1);
    ASSERT_TRUE(decoded.ok()) << decoded.error().to_string();
    EXPECT_NE(decoded->find(longest), nullptr);
    EXPECT_EQ(decoded->header.data_window, tile.header.data_window);
    EXPECT_EQ(decoded->header.frame_height, 65536);
  }
}

}  // namespace
}  // namespace helio
