// Texture lookups against the definition, written out again in double precision, for every format and wrap mode.
#include "renderer/scene/images/texture.h"

#include <gtest/gtest.h>
#include <half.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/support/random.h"

namespace helio {
namespace {

using test::Random;

template <class T>
Image make_image(int width, int height, int channels, TexelFormat format, const std::vector<T>& texels) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = channels;
  image.format = format;
  image.texels.resize(texels.size() * sizeof(T));
  std::memcpy(image.texels.data(), texels.data(), image.texels.size());
  return image;
}

TextureSlot slot_of(WrapMode u, WrapMode v, TexelEncoding encoding = TexelEncoding::linear) {
  TextureSlot slot;
  slot.image = 0;
  slot.wrap_u = u;
  slot.wrap_v = v;
  slot.encoding = encoding;
  return slot;
}

// The curve of IEC 61966-2-1, in double.
double decode_srgb(double e) {
  return e <= 0.04045 ? e / 12.92 : std::pow((e + 0.055) / 1.055, 2.4);
}

// Index of texel i under a wrap mode, i any integer (glTF 2.0, 3.8.4.5).
int wrapped(long i, int size, WrapMode wrap) {
  if (wrap == WrapMode::clamp) return int(std::clamp<long>(i, 0, size - 1));
  const long period = wrap == WrapMode::repeat ? size : 2L * size;
  const long j = ((i % period) + period) % period;
  return int(j < size ? j : 2L * size - 1 - j);
}

double bilinear(const Image& image, int channel, WrapMode wrap_u, WrapMode wrap_v, double u, double v, bool srgb) {
  const double x = u * image.width - 0.5, y = v * image.height - 0.5;
  double sum = 0;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const double wx = dx ? x - std::floor(x) : 1 - (x - std::floor(x));
      const double wy = dy ? y - std::floor(y) : 1 - (y - std::floor(y));
      const int i = wrapped(long(std::floor(x)) + dx, image.width, wrap_u);
      const int j = wrapped(long(std::floor(y)) + dy, image.height, wrap_v);
      const double stored = image.texels[std::size_t((j * image.width + i) * image.channels + channel)] / 255.0;
      sum += wx * wy * (srgb ? decode_srgb(stored) : stored);
    }
  }
  return sum;
}

constexpr WrapMode kWraps[] = {WrapMode::repeat, WrapMode::clamp, WrapMode::mirror};

TEST(Texture, BilinearMatchesTheDefinition) {
  Random random(1);
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(2, 3), std::pair(5, 4), std::pair(16, 1)}) {
    std::vector<std::uint8_t> texels(std::size_t(width) * height * 4);
    for (std::uint8_t& t : texels) t = std::uint8_t(random.next_u32());
    const std::vector<Image> images = {make_image(width, height, 4, TexelFormat::u8, texels)};
    const TextureTable table(images);
    for (const WrapMode wrap_u : kWraps) {
      for (const WrapMode wrap_v : kWraps) {
        for (const TexelEncoding encoding : {TexelEncoding::linear, TexelEncoding::srgb}) {
          const TextureSlot slot = slot_of(wrap_u, wrap_v, encoding);
          for (int i = 0; i < 200; ++i) {
            const V2f uv(random.next_float() * 8 - 4, random.next_float() * 8 - 4);
            const V4f found = table.lookup(slot, uv);
            for (int c = 0; c < 4; ++c) {
              const bool srgb = encoding == TexelEncoding::srgb && c < 3;
              // A float u of 4 is known to 2.4e-7, times 16 texels.
              EXPECT_NEAR(found[c], bilinear(images[0], c, wrap_u, wrap_v, uv.x, uv.y, srgb), 1e-5)
                  << width << "x" << height << " uv " << uv << " channel " << c;
            }
          }
        }
      }
    }
  }
}

TEST(Texture, TexelCentresGiveTexelsAndTheOriginIsTheTopLeft) {
  const std::vector<std::uint8_t> texels = {10, 20, 30, 40, 50, 60};  // 3 x 2, grey
  const std::vector<Image> images = {make_image(3, 2, 1, TexelFormat::u8, texels)};
  const TextureTable table(images);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) {
      const V4f found = table.lookup(slot_of(WrapMode::repeat, WrapMode::repeat), {(x + 0.5f) / 3, (y + 0.5f) / 2});
      const float wanted = float(texels[std::size_t(y * 3 + x)]) / 255;
      EXPECT_NEAR(found.x, wanted, 1e-6f);
      EXPECT_EQ(found.x, found.y);
      EXPECT_EQ(found.x, found.z);
      EXPECT_EQ(found.w, 1.0f);
    }
  }
  TextureSlot nearest = slot_of(WrapMode::clamp, WrapMode::clamp);
  nearest.filter = FilterMode::nearest;
  EXPECT_FLOAT_EQ(table.lookup(nearest, {0.0f, 0.0f}).x, 10 / 255.0f);
  EXPECT_FLOAT_EQ(table.lookup(nearest, {0.34f, 0.49f}).x, 20 / 255.0f);
  EXPECT_FLOAT_EQ(table.lookup(nearest, {1.0f, 1.0f}).x, 60 / 255.0f);
}

TEST(Texture, FiltersInLinearLight) {
  // Black beside white, sRGB-encoded: halfway is half the light, not the code 128.
  const std::vector<std::uint8_t> texels = {0, 255};
  const std::vector<Image> images = {make_image(2, 1, 1, TexelFormat::u8, texels)};
  const TextureTable table(images);
  const TextureSlot slot = slot_of(WrapMode::clamp, WrapMode::clamp, TexelEncoding::srgb);
  EXPECT_NEAR(table.lookup(slot, {0.5f, 0.5f}).x, 0.5f, 1e-6f);
}

TEST(Texture, EveryFormatMeansTheSameNumbers) {
  // Values that all four formats can hold exactly or to their rounding: 0, 51/255 = 0.2, 1.
  const double values[] = {0.0, 0.2, 1.0, 0.6};
  std::vector<std::uint8_t> u8;
  std::vector<std::uint16_t> u16;
  std::vector<half> f16;
  std::vector<float> f32;
  for (const double v : values) {
    u8.push_back(std::uint8_t(std::lround(v * 255)));
    u16.push_back(std::uint16_t(std::lround(v * 65535)));
    f16.push_back(half(float(v)));
    f32.push_back(float(v));
  }
  for (int channels = 1; channels <= 4; channels += channels == 2 ? 2 : 1) {
    const int width = 4 / channels;
    const std::vector<Image> images = {
        make_image(width, 1, channels, TexelFormat::u8, u8), make_image(width, 1, channels, TexelFormat::u16, u16),
        make_image(width, 1, channels, TexelFormat::f16, f16), make_image(width, 1, channels, TexelFormat::f32, f32)};
    const TextureTable table(images);
    for (int i = 0; i < 4; ++i) {
      for (const TexelEncoding encoding : {TexelEncoding::linear, TexelEncoding::srgb}) {
        const bool srgb = encoding == TexelEncoding::srgb;
        const V4f texel = table.texel(i, encoding, width - 1, 0);
        const std::size_t first = std::size_t((width - 1) * channels);
        const double grey = srgb ? decode_srgb(values[first]) : values[first];
        // Half holds 0.6 to 2^-12.
        EXPECT_NEAR(texel.x, grey, 5e-4);
        const double alpha = channels == 1 ? 1 : values[3];  // never decoded
        EXPECT_NEAR(texel.w, alpha, 5e-4) << channels;
      }
    }
  }
}

TEST(Texture, TransparencyIsAlphaBelowOneAnywhere) {
  const half one(1.0f);
  const std::vector<Image> images = {
      make_image<std::uint8_t>(2, 1, 4, TexelFormat::u8, {1, 2, 3, 255, 4, 5, 6, 255}),
      make_image<std::uint8_t>(2, 1, 4, TexelFormat::u8, {255, 255, 255, 255, 255, 255, 255, 254}),
      make_image<std::uint8_t>(1, 1, 3, TexelFormat::u8, {0, 0, 0}),
      make_image<std::uint16_t>(1, 1, 2, TexelFormat::u16, {0, 65535}),
      make_image<std::uint16_t>(1, 1, 2, TexelFormat::u16, {0, 65534}),
      make_image<half>(1, 1, 2, TexelFormat::f16, {half(0.0f), one}),
      make_image<half>(1, 1, 2, TexelFormat::f16, {one, half(0.5f)}),
      make_image<float>(1, 1, 4, TexelFormat::f32, {0, 0, 0, 1}),
      make_image<float>(1, 1, 4, TexelFormat::f32, {0, 0, 0, 0.999f})};
  const TextureTable table(images);
  const bool wanted[] = {false, true, false, false, true, false, true, false, true};
  for (std::size_t i = 0; i < images.size(); ++i) EXPECT_EQ(table.has_transparency(int(i)), wanted[i]) << i;
}

TEST(Texture, AppliesTheSlotsTransform) {
  Random random(5);
  std::vector<std::uint8_t> texels(8 * 8);
  for (std::uint8_t& t : texels) t = std::uint8_t(random.next_u32());
  const std::vector<Image> images = {make_image(8, 8, 1, TexelFormat::u8, texels)};
  const TextureTable table(images);
  const TextureSlot plain = slot_of(WrapMode::repeat, WrapMode::repeat);
  TextureSlot moved = plain;
  moved.uv_transform = {0, 2, 0.25f, -1, 0, 0.5f};  // u' = 2 v + 0.25, v' = -u + 0.5
  EXPECT_EQ(table.lookup(moved, {0.3f, 0.7f}), table.lookup(plain, {2 * 0.7f + 0.25f, -0.3f + 0.5f}));
}

TEST(Texture, AnyCoordinateIsSafe) {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const float hard[] = {
      nan,    inf,     -inf,   3.4e38f, -3.4e38f, 1e9f, -1e9f, 9.9e8f, -9.9e8f,          8388609.5f,
      1e-45f, -1e-45f, -1e-9f, 0.0f,    -0.0f,    1.0f, -1.0f, 2.0f,   kOneMinusEpsilon, -kOneMinusEpsilon};
  const std::vector<std::uint8_t> texels = {0, 50, 100, 150, 200, 250};
  const std::vector<Image> images = {make_image(3, 2, 1, TexelFormat::u8, texels)};
  const TextureTable table(images, {{slot_of(WrapMode::repeat, WrapMode::repeat)}});
  for (const WrapMode wrap : kWraps) {
    for (const FilterMode filter : {FilterMode::bilinear, FilterMode::nearest}) {
      TextureSlot slot = slot_of(wrap, wrap);
      slot.filter = filter;
      for (const float u : hard) {
        for (const float v : hard) {
          table.prefetch(slot, {u, v});
          for (const float width : {0.0f, 0.3f, 7.0f, inf, nan}) {
            const V4f value = table.lookup(slot, {u, v}, width);
            EXPECT_TRUE(value.x >= 0 && value.x <= 251 / 255.0f) << u << " " << v << " " << width << ": " << value.x;
          }
        }
      }
    }
  }
}

TEST(Texture, MeanIsTheMeanOfDecodedTexels) {
  const std::vector<std::uint8_t> texels = {0, 0, 0, 0, 255, 128, 64, 255};
  const std::vector<Image> images = {make_image(2, 1, 4, TexelFormat::u8, texels)};
  const TextureTable table(images);
  const V4f mean = table.mean(0, TexelEncoding::srgb);
  EXPECT_NEAR(mean.x, 0.5, 1e-6);
  EXPECT_NEAR(mean.y, decode_srgb(128 / 255.0) / 2, 1e-6);
  EXPECT_NEAR(mean.z, decode_srgb(64 / 255.0) / 2, 1e-6);
  EXPECT_NEAR(mean.w, 0.5, 1e-6);
}

TEST(Texture, SrgbCurveInverts) {
  for (int i = -300; i <= 300; ++i) {
    const float x = float(i) / 100;
    EXPECT_NEAR(linear_to_srgb(srgb_to_linear(x)), x, 2e-6f * (1 + std::abs(x)));
  }
  EXPECT_EQ(srgb_to_linear(0.0f), 0.0f);
  EXPECT_EQ(srgb_to_linear(1.0f), 1.0f);
}

}  // namespace
}  // namespace helio
