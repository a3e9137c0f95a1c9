// Texture lookups on a device against TextureTable::lookup: every format, number of channels, encoding, filter and wrap
// mode. Values agree to 1e-5 of the largest texel around; bilinear weights lose digits with the size of the image.
#include <gtest/gtest.h>
#include <half.h>

#include <helio_shaders/texture_queries_comp.h>

#include <cstring>
#include <limits>

#include "renderer/scene/images/texture.h"
#include "renderer/vulkan/scene/texture_tables.h"
#include "renderer/vulkan/shaders/tables/scene.h"
#include "tests/support/random.h"
#include "tests/unit/vulkan/scene_queries.h"
#include "tests/unit/vulkan/test_device.h"
#include "tests/unit/vulkan/texture_queries.h"

namespace helio {
namespace {

using test::Random;
using vulkan::TextureQuery;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

template <class T, class F>
void fill(Image& image, F&& value) {
  const std::size_t count = std::size_t(image.width) * std::size_t(image.height) * std::size_t(image.channels);
  std::vector<T> texels(count);
  for (T& texel : texels) texel = value();
  image.texels.resize(count * sizeof(T));
  std::memcpy(image.texels.data(), texels.data(), image.texels.size());
}

// Random texels; floats are of both signs and of every size down to denormal halves.
Image random_image(int width, int height, int channels, TexelFormat format, Random& random) {
  Image image;
  image.name = "image";
  image.width = width;
  image.height = height;
  image.channels = channels;
  image.format = format;
  const auto real = [&] {
    const float size = std::exp2(-16 + 20 * random.next_float());
    return random.next_float() < 0.3f ? -size : size;
  };
  if (format == TexelFormat::u8) fill<std::uint8_t>(image, [&] { return std::uint8_t(random.next_u32()); });
  if (format == TexelFormat::u16) fill<std::uint16_t>(image, [&] { return std::uint16_t(random.next_u32()); });
  if (format == TexelFormat::f16) fill<half>(image, [&] { return half(real()); });
  if (format == TexelFormat::f32) fill<float>(image, real);
  return image;
}

// Every format and number of channels in sizes down to one texel, odd ones among them, so that texels of three bytes
// lie on every boundary of words.
std::vector<Image> every_image() {
  Random random(1);
  std::vector<Image> images;
  for (const TexelFormat format : {TexelFormat::u8, TexelFormat::u16, TexelFormat::f16, TexelFormat::f32}) {
    for (int channels = 1; channels <= 4; ++channels) {
      for (const auto& [width, height] : {std::pair(1, 1), std::pair(2, 3), std::pair(7, 5), std::pair(16, 1)})
        images.push_back(random_image(width, height, channels, format, random));
    }
  }
  return images;
}

// In and around [0, 1], on its borders, far away, and what is no coordinate at all.
std::vector<V2f> coordinates() {
  Random random(2);
  std::vector<V2f> uvs;
  const std::vector<float> special = {0.0f, -0.0f, 1.0f,     0.5f,      -1e-8f,    kOneMinusEpsilon, -1.0f,
                                      2.0f, -2.5f, 1.0f / 7, 3e6f,      -7.75f,    9.99e8f,          -9.99e8f,
                                      1e9f, 3e38f, kNan,     kInfinity, -kInfinity};
  for (const float u : special) {
    for (const float v : special) uvs.push_back({u, v});
  }
  for (int i = 0; i < 200; ++i) uvs.push_back({6 * random.next_float() - 3, 6 * random.next_float() - 3});
  return uvs;
}

class VulkanTextures : public test::DeviceTest {
 protected:
  // Asks for all of `slots` at all of `uvs`, and compares.
  void compare(const std::vector<Image>& images, const std::vector<TextureSlot>& slots, const std::vector<V2f>& uvs,
               float tolerance) {
    const TextureTable table(images);
    vulkan::Arena arena(device());
    const vulkan::HostTextures host = vulkan::make_host_textures(images);
    Result<vulkan::TextureTables> placed = host.place(arena);
    ASSERT_TRUE(placed.ok());
    vulkan::SceneTables tables{};
    tables.textures = *placed;
    const Result<std::uint64_t> scene = arena.upload(std::as_bytes(std::span(&tables, 1)), 16, "the scene");
    ASSERT_TRUE(scene.ok());
    std::vector<TextureQuery> queries;
    for (const TextureSlot& slot : slots) {
      for (const V2f& uv : uvs) queries.push_back({vulkan::make_texture_slot(slot), uv});
    }
    const std::uint32_t constants[] = {~0u, ~0u, host.features()};
    const Result<std::vector<V4f>> answers =
        test::run_scene_queries<V4f>(device(), texture_queries_comp, *scene, queries, constants);
    ASSERT_TRUE(answers.ok()) << answers.error().to_string();
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const TextureSlot& slot = slots[i / uvs.size()];
      const V2f& uv = uvs[i % uvs.size()];
      const V4f expected = table.lookup(slot, uv);
      for (int c = 0; c < 4; ++c) {
        const float allowed = tolerance * (largest(images[std::size_t(slot.image)]) + std::abs(expected[c]));
        ASSERT_NEAR((*answers)[i][c], expected[c], allowed)
            << "image " << slot.image << " wraps " << int(slot.wrap_u) << " " << int(slot.wrap_v) << " filter "
            << int(slot.filter) << " encoding " << int(slot.encoding) << " uv " << uv.x << " " << uv.y << " channel "
            << c;
      }
    }
  }

  // What the values of an image stay below, but for its encoding.
  static float largest(const Image& image) {
    return image.format == TexelFormat::u8 || image.format == TexelFormat::u16 ? 1.0f : 16.0f;
  }
};

std::vector<TextureSlot> slots_of(const std::vector<Image>& images, FilterMode filter) {
  std::vector<TextureSlot> slots;
  constexpr WrapMode kWraps[] = {WrapMode::repeat, WrapMode::clamp, WrapMode::mirror};
  for (std::size_t i = 0; i < images.size(); ++i) {
    for (int modes = 0; modes < 18; ++modes) {
      TextureSlot slot;
      slot.image = int(i);
      slot.filter = filter;
      slot.wrap_u = kWraps[modes % 3];
      slot.wrap_v = kWraps[modes / 3 % 3];
      slot.encoding = modes < 9 ? TexelEncoding::linear : TexelEncoding::srgb;
      slots.push_back(slot);
    }
  }
  return slots;
}

TEST_F(VulkanTextures, NearestTexelsAreThoseOfTheHost) {
  const std::vector<Image> images = every_image();
  compare(images, slots_of(images, FilterMode::nearest), coordinates(), 1e-6f);
}

TEST_F(VulkanTextures, BilinearValuesAreThoseOfTheHost) {
  const std::vector<Image> images = every_image();
  compare(images, slots_of(images, FilterMode::bilinear), coordinates(), 1e-5f);
}

// Shaders that are made for images of one format alone.
TEST_F(VulkanTextures, EachFormatAlone) {
  for (const Image& image : every_image()) {
    if (image.width == 7) compare({image}, slots_of({image}, FilterMode::bilinear), coordinates(), 1e-5f);
  }
}

// sRGB-encoded floats are extrapolated beyond [0, 1]; exact to the digits that pow() has.
TEST_F(VulkanTextures, LargeValuesKeepTheirSize) {
  Image image;
  image.width = image.height = 2;
  image.channels = 1;
  image.format = TexelFormat::f32;
  const std::vector<float> texels = {1e10f, -2e4f, 65504, 1e-10f};
  std::size_t i = 0;
  fill<float>(image, [&] { return texels[i++]; });
  compare({image}, slots_of({image}, FilterMode::bilinear),
          {{0.25f, 0.25f}, {0.75f, 0.25f}, {0.25f, 0.75f}, {0.6f, 0.3f}}, 1e-4f);
}

TEST_F(VulkanTextures, TransformsOfCoordinates) {
  Random random(3);
  const std::vector<Image> images = every_image();
  std::vector<TextureSlot> slots = slots_of(images, FilterMode::bilinear);
  for (TextureSlot& slot : slots) {
    for (float& m : slot.uv_transform) m = 4 * random.next_float() - 2;
  }
  std::vector<V2f> uvs;
  for (int k = 0; k < 20; ++k) uvs.push_back(random.next_v2f());
  compare(images, slots, uvs, 1e-4f);
}

}  // namespace
}  // namespace helio
