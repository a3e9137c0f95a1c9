// Images decode to exactly the pixels that were encoded, and nothing that a header claims is believed unchecked.
#include "renderer/scene/images/image_decoder.h"

#include <gtest/gtest.h>
#include <half.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/support/random.h"
#include "tests/unit/scene/images/image_encode.h"

namespace helio {
namespace {

using test::encode_image;
using test::Random;

constexpr std::uint64_t kLimit = 64 << 20;

template <class T>
std::vector<T> texels_of(const Image& image) {
  std::vector<T> values(image.texels.size() / sizeof(T));
  std::memcpy(values.data(), image.texels.data(), image.texels.size());
  return values;
}

void append_be32(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(std::uint8_t(value >> shift));
}

// A PNG whose header says 8-bit RGBA of the given size, followed by almost nothing.
std::vector<std::uint8_t> png_claiming(std::uint32_t width, std::uint32_t height) {
  std::vector<std::uint8_t> bytes = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n', 0, 0, 0, 13, 'I', 'H', 'D', 'R'};
  append_be32(bytes, width);
  append_be32(bytes, height);
  bytes.insert(bytes.end(), {8, 6, 0, 0, 0, 0, 0, 0, 0});
  return bytes;
}

// Baseline JPEG of one 8x8 block per component, every coefficient 0: each sample is 128. Huffman tables of a single
// one-bit code, so that a block is the two bits 00.
std::vector<std::uint8_t> flat_jpeg(std::uint16_t width, std::uint16_t height, int components, bool adobe) {
  std::vector<std::uint8_t> b = {0xff, 0xd8};
  const auto add = [&](std::initializer_list<int> values) {
    for (const int v : values) b.push_back(std::uint8_t(v));
  };
  if (adobe) add({0xff, 0xee, 0, 14, 'A', 'd', 'o', 'b', 'e', 0, 100, 0, 0, 0, 0, 0});
  add({0xff, 0xdb, 0, 67, 0});
  for (int i = 0; i < 64; ++i) b.push_back(1);
  add({0xff, 0xc0, 0, 8 + 3 * components, 8, height >> 8, height & 255, width >> 8, width & 255, components});
  for (int i = 1; i <= components; ++i) add({i, 0x11, 0});
  for (const int table : {0x00, 0x10}) {
    add({0xff, 0xc4, 0, 20, table, 1});
    for (int i = 0; i < 15; ++i) b.push_back(0);
    b.push_back(0);
  }
  add({0xff, 0xda, 0, 6 + 2 * components, components});
  for (int i = 1; i <= components; ++i) add({i, 0});
  add({0, 63, 0, 0x00, 0xff, 0xd9});
  return b;
}

TEST(ImageDecoder, KeepsEightBitTexelsAndUnassociatedAlpha) {
  const std::vector<std::uint8_t> pixels = {255, 10, 20, 0, 1, 2, 3, 128, 200, 100, 50, 255, 0, 0, 0, 7};
  OIIO::ImageSpec spec(2, 2, 4, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  const Result<Image> image = decode_image(encode_image("png", spec, pixels.data()), "a.png", kLimit);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  EXPECT_EQ(image->name, "a.png");
  EXPECT_EQ(image->width, 2);
  EXPECT_EQ(image->height, 2);
  EXPECT_EQ(image->channels, 4);
  EXPECT_EQ(image->format, TexelFormat::u8);
  EXPECT_EQ(image->texels, pixels);
}

TEST(ImageDecoder, KeepsSixteenBitTexels) {
  const std::vector<std::uint16_t> pixels = {0, 1, 65535, 256, 255, 40000};
  const OIIO::ImageSpec spec(2, 1, 3, OIIO::TypeDesc::UINT16);
  const Result<Image> image = decode_image(encode_image("png", spec, pixels.data()), "b.png", kLimit);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  EXPECT_EQ(image->format, TexelFormat::u16);
  EXPECT_EQ(texels_of<std::uint16_t>(*image), pixels);
}

TEST(ImageDecoder, KeepsHalfAndFloatTexels) {
  const std::vector<float> pixels = {0.5f, -1.0f, 65504.0f, 1e-5f, 3.0f, 0.25f};
  for (const bool as_half : {true, false}) {
    const OIIO::ImageSpec spec(1, 2, 3, as_half ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
    std::vector<half> halves(pixels.begin(), pixels.end());
    const void* data = as_half ? static_cast<const void*>(halves.data()) : pixels.data();
    const Result<Image> image = decode_image(encode_image("openexr", spec, data), "c.exr", kLimit);
    ASSERT_TRUE(image.ok()) << image.error().to_string();
    EXPECT_EQ(image->format, as_half ? TexelFormat::f16 : TexelFormat::f32);
    EXPECT_EQ(std::memcmp(image->texels.data(), data, image->texels.size()), 0);
  }
}

TEST(ImageDecoder, PicksColourChannelsOfAnExrByName) {
  // Stored with more channels than colour has; the values say which channel they belong to.
  OIIO::ImageSpec spec(1, 1, 6, OIIO::TypeDesc::FLOAT);
  spec.channelnames = {"R", "G", "B", "A", "Z", "id"};
  const std::vector<float> pixels = {1, 2, 3, 4, 5, 6};
  const Result<Image> image = decode_image(encode_image("openexr", spec, pixels.data()), "d.exr", kLimit);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  EXPECT_EQ(texels_of<float>(*image), (std::vector<float>{1, 2, 3, 4}));

  spec.nchannels = 2;
  spec.channelnames = {"velocity.x", "velocity.y"};
  const Result<Image> none = decode_image(encode_image("openexr", spec, pixels.data()), "d.exr", kLimit);
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("velocity.x, velocity.y"), std::string::npos) << none.error().message;
}

std::string all_of(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  return all;
}

// 2x2 texels 1..4 stored at (x, y) of a picture of width x height.
Result<Image> decode_stored_at(int x, int y, int width, int height, std::vector<std::string>* notices = nullptr) {
  OIIO::ImageSpec spec(2, 2, 1, OIIO::TypeDesc::FLOAT);
  spec.channelnames = {"Y"};
  spec.full_x = 10;  // the display window need not begin at 0
  spec.full_y = -20;
  spec.x = 10 + x;
  spec.y = -20 + y;
  spec.full_width = width;
  spec.full_height = height;
  const std::vector<float> pixels = {1, 2, 3, 4};
  return decode_image(encode_image("openexr", spec, pixels.data()), "w.exr", kLimit, notices);
}

TEST(ImageDecoder, AnExrIsItsDisplayWindow) {
  std::vector<std::string> notices;
  const Result<Image> part = decode_stored_at(1, 1, 4, 3, &notices);
  ASSERT_TRUE(part.ok()) << part.error().to_string();
  EXPECT_EQ(part->width, 4);
  EXPECT_EQ(part->height, 3);
  EXPECT_EQ(texels_of<float>(*part), (std::vector<float>{0, 0, 0, 0, 0, 1, 2, 0, 0, 3, 4, 0}));
  EXPECT_EQ(all_of(notices), "w.exr: stores 2x2 texels at (1, 1) of its picture of 4x3; what is missing is black\n");

  const Result<Image> overscan = decode_stored_at(-1, -1, 2, 1);
  ASSERT_TRUE(overscan.ok()) << overscan.error().to_string();
  EXPECT_EQ(texels_of<float>(*overscan), (std::vector<float>{4, 0}));

  notices.clear();
  const Result<Image> whole = decode_stored_at(0, 0, 2, 2, &notices);
  ASSERT_TRUE(whole.ok()) << whole.error().to_string();
  EXPECT_EQ(texels_of<float>(*whole), (std::vector<float>{1, 2, 3, 4}));
  EXPECT_EQ(all_of(notices), "");

  const Result<Image> outside = decode_stored_at(5, 0, 4, 3);
  ASSERT_FALSE(outside.ok());
  EXPECT_NE(outside.error().message.find("data window (2x2 texels at 5, 0) lies outside of its display window (4x3)"),
            std::string::npos)
      << outside.error().message;
  for (const int side : {20000, 70000}) {
    const Result<Image> huge = decode_stored_at(0, 0, side, side);
    ASSERT_FALSE(huge.ok()) << side;
    EXPECT_EQ(huge.error().code, ErrorCode::resource_exhausted);
  }
}

// One texel, whose channels hold 1, 2, 3, ... in the order given.
Result<Image> decode_layers(const std::vector<std::string>& channels, std::vector<std::string>* notices = nullptr) {
  OIIO::ImageSpec spec(1, 1, int(channels.size()), OIIO::TypeDesc::FLOAT);
  spec.channelnames = channels;
  std::vector<float> pixels;
  for (std::size_t i = 0; i < channels.size(); ++i) pixels.push_back(float(i + 1));
  return decode_image(encode_image("openexr", spec, pixels.data()), "l.exr", kLimit, notices);
}

TEST(ImageDecoder, OfLayersTheDefaultIsTakenAndNamed) {
  // "Ambient.R" sorts before "B".
  std::vector<std::string> notices;
  Result<Image> image = decode_layers({"Ambient.R", "Ambient.G", "Ambient.B", "R", "G", "B", "velocity.x"}, &notices);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  EXPECT_EQ(texels_of<float>(*image), (std::vector<float>{4, 5, 6}));
  EXPECT_EQ(all_of(notices), "l.exr: its channels without a layer are used, not \"Ambient\", \"velocity\"\n");

  notices.clear();
  image = decode_layers({"main.Combined.R", "main.Combined.G", "main.Combined.B", "main.Combined.A", "a.R", "a.G", "a.B"},
                        &notices);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  EXPECT_EQ(texels_of<float>(*image), (std::vector<float>{1, 2, 3, 4}));
  EXPECT_EQ(all_of(notices), "l.exr: its layer \"main.Combined\" is used, not \"a\"\n");

  notices.clear();
  image = decode_layers({"sky.R", "sky.G", "sky.B"}, &notices);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  EXPECT_EQ(texels_of<float>(*image), (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(all_of(notices), "l.exr: its layer \"sky\" is used\n");

  for (const auto& channels : std::vector<std::vector<std::string>>{
           {"day.R", "day.G", "day.B", "night.R", "night.G", "night.B"},
           {"a.beauty.R", "a.beauty.G", "a.beauty.B", "b.beauty.R", "b.beauty.G", "b.beauty.B"}}) {
    image = decode_layers(channels);
    ASSERT_FALSE(image.ok());
    EXPECT_EQ(image.error().code, ErrorCode::invalid_argument);
    for (const std::string& channel : {channels[0], channels[3]}) {
      const std::string layer = "\"" + channel.substr(0, channel.size() - 2) + "\"";
      EXPECT_NE(image.error().message.find(layer), std::string::npos) << image.error().message;
    }
  }
  // The colour of two layers is not one colour.
  EXPECT_FALSE(decode_layers({"a.R", "b.G", "b.B"}).ok());
}

// Parts of one texel each, with these channels; the n-th channel of all holds n.
Result<Image> decode_parts(const std::vector<std::pair<std::string, std::vector<std::string>>>& parts,
                           std::vector<std::string>* notices = nullptr) {
  std::vector<OIIO::ImageSpec> specs;
  for (const auto& [name, channels] : parts) {
    OIIO::ImageSpec& spec = specs.emplace_back(1, 1, int(channels.size()), OIIO::TypeDesc::FLOAT);
    spec.channelnames = channels;
    spec.attribute("oiio:subimagename", name);
  }
  // OpenImageIO writes several parts to files only.
  const auto path = std::filesystem::temp_directory_path() / ("helio-parts-" + std::to_string(getpid()) + ".exr");
  const std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create("openexr");
  EXPECT_TRUE(out->open(path.string(), int(specs.size()), specs.data())) << out->geterror();
  float next = 1;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    if (i > 0) {
      EXPECT_TRUE(out->open(path.string(), specs[i], OIIO::ImageOutput::AppendSubimage)) << out->geterror();
    }
    std::vector<float> pixels;
    for (int c = 0; c < specs[i].nchannels; ++c) pixels.push_back(next++);
    EXPECT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, pixels.data())) << out->geterror();
  }
  EXPECT_TRUE(out->close());
  std::ifstream file(path, std::ios::binary);
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
  std::filesystem::remove(path);
  return decode_image(bytes, "p.exr", kLimit, notices);
}

TEST(ImageDecoder, OfPartsTheFirstOrTheOnlyOneWithColourIsTakenAndNamed) {
  std::vector<std::string> notices;
  Result<Image> image = decode_parts({{"rgb", {"R", "G", "B"}}, {"diffuse", {"R", "G", "B"}}}, &notices);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  EXPECT_EQ(texels_of<float>(*image), (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(all_of(notices), "p.exr: its part \"rgb\" is used, not \"diffuse\"\n");

  notices.clear();
  image = decode_parts({{"normals", {"N.x", "N.y", "N.z"}}, {"sky", {"R", "G", "B"}}}, &notices);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  EXPECT_EQ(texels_of<float>(*image), (std::vector<float>{4, 5, 6}));
  EXPECT_EQ(all_of(notices), "p.exr: its part \"sky\" is used, not \"normals\"\n");

  image = decode_parts({{"normals", {"N.x", "N.y", "N.z"}}, {"day", {"R", "G", "B"}}, {"night", {"R", "G", "B"}}});
  ASSERT_FALSE(image.ok());
  EXPECT_NE(image.error().message.find("the parts \"day\", \"night\" leave a choice"), std::string::npos)
      << image.error().message;
}

// Taken for a grey image, such a file would lose its colour without a word.
TEST(ImageDecoder, RefusesLuminanceChromaExr) {
  const std::vector<float> pixels = {0.5f, 0.1f, 0.2f, 1};
  for (const std::vector<std::string>& names : std::vector<std::vector<std::string>>{
           {"Y", "RY", "BY"}, {"Y", "RY", "BY", "A"}, {"Y", "RY", "BY", "Alpha"}, {"left.Y", "left.RY", "left.BY"}}) {
    OIIO::ImageSpec spec(1, 1, static_cast<int>(names.size()), OIIO::TypeDesc::FLOAT);
    spec.channelnames = names;
    const Result<Image> image = decode_image(encode_image("openexr", spec, pixels.data()), "yc.exr", kLimit);
    ASSERT_FALSE(image.ok()) << names.front() << ", " << names.size() << " channels";
    EXPECT_EQ(image.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(image.error().message.find("luminance-chroma"), std::string::npos) << image.error().message;
  }
}

TEST(ImageDecoder, RefusesIntegerExrByType) {
  const std::vector<std::uint32_t> pixels = {7};
  OIIO::ImageSpec spec(1, 1, 1, OIIO::TypeDesc::UINT32);
  spec.channelnames = {"Y"};
  const Result<Image> image = decode_image(encode_image("openexr", spec, pixels.data()), "ids.exr", kLimit);
  ASSERT_FALSE(image.ok());
  EXPECT_EQ(image.error().code, ErrorCode::unimplemented);
  EXPECT_EQ(image.error().where, "ids.exr");
}

TEST(ImageDecoder, ReadsRadianceHdr) {
  // RGBE keeps powers of two exactly when the channels share an exponent.
  const std::vector<float> pixels = {1024, 512, 256, 0.5f, 0.25f, 0.125f};
  const OIIO::ImageSpec spec(2, 1, 3, OIIO::TypeDesc::FLOAT);
  const Result<Image> image = decode_image(encode_image("hdr", spec, pixels.data()), "e.hdr", kLimit);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  EXPECT_EQ(image->format, TexelFormat::f32);
  const std::vector<float> texels = texels_of<float>(*image);
  for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_NEAR(texels[i] / pixels[i], 1.0f, 1.0f / 128) << i;
}

TEST(ImageDecoder, ReadsBinaryPnm) {
  const std::string text = "P6 2 1 255\n";
  std::vector<std::uint8_t> bytes(text.begin(), text.end());
  bytes.insert(bytes.end(), {1, 2, 3, 250, 251, 252});
  const Result<Image> image = decode_image(bytes, "f.ppm", kLimit);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  EXPECT_EQ(image->texels, (std::vector<std::uint8_t>{1, 2, 3, 250, 251, 252}));
}

TEST(ImageDecoder, TurnsCmykJpegIntoRgb) {
  // All four inks at 128. Adobe writes inks inverted, so R = G = B = 128 * 128 / 255 = 64; without inversion 63.
  const Result<Image> image = decode_image(flat_jpeg(8, 8, 4, true), "g.jpg", kLimit);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  ASSERT_EQ(image->channels, 3);
  for (const std::uint8_t value : image->texels) EXPECT_NEAR(value, 64, 1);
}

TEST(ImageDecoder, ReadsGreyJpeg) {
  const Result<Image> image = decode_image(flat_jpeg(8, 8, 1, false), "h.jpg", kLimit);
  ASSERT_TRUE(image.ok()) << image.error().to_string();
  EXPECT_EQ(image->texels, std::vector<std::uint8_t>(64, 128));
}

TEST(ImageDecoder, RefusesUnknownContentWhateverTheName) {
  const std::string text = "GIF89a is not read";
  const Result<Image> image =
      decode_image({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, "i.png", kLimit);
  ASSERT_FALSE(image.ok());
  EXPECT_EQ(image.error().code, ErrorCode::unimplemented);
  EXPECT_EQ(image.error().where, "i.png");
  EXPECT_FALSE(decode_image({}, "empty", kLimit).ok());
}

TEST(ImageDecoder, ClaimsBeyondTheFileAreRefusedBeforeAllocation) {
  struct Case {
    std::vector<std::uint8_t> bytes;
    ErrorCode code;
  };
  const Case cases[] = {
      {png_claiming(30000, 30000), ErrorCode::invalid_argument},  // 3.6 GB from 41 bytes
      {png_claiming(70000, 1), ErrorCode::resource_exhausted},    // beyond kMaxImageSide
      {png_claiming(0, 5), ErrorCode::invalid_argument},
      {png_claiming(0x80000001u, 5), ErrorCode::resource_exhausted},
      {flat_jpeg(60000, 60000, 3, false), ErrorCode::invalid_argument},
      {flat_jpeg(60000, 60000, 4, true), ErrorCode::invalid_argument},
  };
  for (const Case& c : cases) {
    const Result<Image> image = decode_image(c.bytes, "bomb", std::uint64_t(1) << 40);
    ASSERT_FALSE(image.ok());
    EXPECT_EQ(image.error().code, c.code) << image.error().to_string();
  }
  // Text formats say their size to the decoder alone.
  for (const std::string text : {"P6 60000 60000 255\n", "P5 60000 60000 65535\n", "P1 60000 60000\n",
                                 "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n"}) {
    const Result<Image> image =
        decode_image({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, "bomb", std::uint64_t(1) << 40);
    ASSERT_FALSE(image.ok()) << text;
    EXPECT_EQ(image.error().code, ErrorCode::invalid_argument) << image.error().to_string();
  }
}

TEST(ImageDecoder, HoldsToTheMemoryLimit) {
  const std::vector<std::uint8_t> pixels(100 * 100 * 3, 9);
  const std::vector<std::uint8_t> file =
      encode_image("png", OIIO::ImageSpec(100, 100, 3, OIIO::TypeDesc::UINT8), pixels.data());
  EXPECT_TRUE(decode_image(file, "j.png", 30000).ok());
  const Result<Image> image = decode_image(file, "j.png", 29999);
  ASSERT_FALSE(image.ok());
  EXPECT_EQ(image.error().code, ErrorCode::resource_exhausted);
  EXPECT_NE(image.error().message.find("30000"), std::string::npos) << image.error().message;
  EXPECT_NE(image.error().message.find("29999"), std::string::npos) << image.error().message;
}

TEST(ImageDecoder, StartsNoThreads) {
  const auto threads = [] {
    int count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) ++count;
    return count;
  };
  if (!std::filesystem::exists("/proc/self/task")) GTEST_SKIP() << "skipped: no /proc";
  const std::vector<float> pixels(256 * 256 * 3, 0.5f);
  const std::vector<std::uint8_t> file =
      encode_image("openexr", OIIO::ImageSpec(256, 256, 3, OIIO::TypeDesc::FLOAT), pixels.data());
  const int before = threads();
  ASSERT_TRUE(decode_image(file, "k.exr", kLimit).ok());
  EXPECT_LE(threads(), before);
}

// Cut-off and damaged files of every format: an error with the name, or an image whose parts agree.
TEST(ImageDecoder, DamagedFilesNeverCrash) {
  Random random(2026);
  const int width = 24, height = 16;
  std::vector<std::uint8_t> bytes8(width * height * 3);
  for (std::uint8_t& value : bytes8) value = std::uint8_t(random.next_u32());
  std::vector<float> floats(bytes8.begin(), bytes8.end());
  const OIIO::ImageSpec spec8(width, height, 3, OIIO::TypeDesc::UINT8), spec32(width, height, 3, OIIO::TypeDesc::FLOAT);
  OIIO::ImageSpec progressive = spec8;
  progressive.attribute("jpeg:progressive", 1);

  struct Sample {
    const char* name;
    std::vector<std::uint8_t> bytes;
  };
  std::vector<Sample> samples = {{"png", encode_image("png", spec8, bytes8.data())},
                                 {"jpeg", encode_image("jpeg", spec8, bytes8.data())},
                                 {"progressive", encode_image("jpeg", progressive, bytes8.data())},
                                 {"hdr", encode_image("hdr", spec32, floats.data())}};
  for (const char* compression : {"none", "rle", "zip", "piz", "pxr24", "b44", "dwaa"}) {
    OIIO::ImageSpec spec = spec32;
    spec.attribute("compression", compression);
    samples.push_back({compression, encode_image("openexr", spec, floats.data())});
  }
  for (const Sample& sample : samples) {
    ASSERT_TRUE(decode_image(sample.bytes, sample.name, kLimit).ok()) << sample.name;
    int refused = 0;
    for (int round = 0; round < 90; ++round) {
      std::vector<std::uint8_t> damaged = sample.bytes;
      if (round % 3 == 0) {
        damaged.resize(random.next_u32() % damaged.size());
      } else {
        // Half of the damage goes to the header, where sizes are.
        const std::size_t reach = round % 3 == 1 ? std::min<std::size_t>(damaged.size(), 400) : damaged.size();
        for (int i = 0; i < 1 + round % 4; ++i) damaged[random.next_u32() % reach] = std::uint8_t(random.next_u32());
      }
      const Result<Image> image = decode_image(damaged, sample.name, kLimit);
      if (!image) {
        ++refused;
        EXPECT_EQ(image.error().where, sample.name);
        EXPECT_FALSE(image.error().message.empty());
        continue;
      }
      const std::size_t size[] = {1, 2, 2, 4};
      EXPECT_EQ(image->texels.size(),
                std::size_t(image->width) * image->height * image->channels * size[int(image->format)]);
    }
    EXPECT_GT(refused, 18) << sample.name;
  }
}

}  // namespace
}  // namespace helio
