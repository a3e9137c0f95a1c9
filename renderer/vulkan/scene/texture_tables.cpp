#include "renderer/vulkan/scene/texture_tables.h"

#include <algorithm>

#include "renderer/scene/images/texture.h"

namespace helio::vulkan {
namespace {

// Texels are read as words of four bytes, and f32 texels of four channels as one of sixteen where the compiler can.
constexpr std::uint64_t kTexelAlignment = 16;

static_assert(std::uint32_t(TexelFormat::u8) == kTexelU8 && std::uint32_t(TexelFormat::u16) == kTexelU16 &&
              std::uint32_t(TexelFormat::f16) == kTexelF16 && std::uint32_t(TexelFormat::f32) == kTexelF32);
static_assert(std::uint32_t(WrapMode::repeat) == kWrapRepeat && std::uint32_t(WrapMode::clamp) == kWrapClamp &&
              std::uint32_t(WrapMode::mirror) == kWrapMirror);

std::vector<float> srgb_table(std::size_t codes) {
  std::vector<float> values(codes);
  for (std::size_t i = 0; i < codes; ++i) values[i] = srgb_to_linear(float(i) / float(codes - 1));
  return values;
}

}  // namespace

TextureSlotTable make_texture_slot(const TextureSlot& slot) {
  TextureSlotTable table{};
  table.image = slot.present() ? std::uint32_t(slot.image) : kNone;
  table.texcoord = slot.texcoord;
  table.modes = std::uint32_t(slot.wrap_u) | std::uint32_t(slot.wrap_v) << kWrapVShift |
                (slot.filter == FilterMode::nearest ? kFilterNearest : 0) |
                (slot.encoding == TexelEncoding::srgb ? kEncodingSrgb : 0);
  std::copy(slot.uv_transform.begin(), slot.uv_transform.end(), table.uv_transform);
  return table;
}

HostTextures make_host_textures(std::span<const Image> images) {
  HostTextures textures;
  textures.srgb_u8 = srgb_table(256);
  for (const Image& image : images) {
    textures.images.push_back({.texels = 0,
                               .srgb = 0,
                               .width = std::uint32_t(image.width),
                               .height = std::uint32_t(image.height),
                               .channels = std::uint32_t(image.channels),
                               .format = std::uint32_t(image.format)});
    textures.texels.push_back(std::as_bytes(std::span(image.texels)));
    textures.names.push_back(image.name);
    if (image.format == TexelFormat::u16 && textures.srgb_u16.empty()) textures.srgb_u16 = srgb_table(65536);
  }
  return textures;
}

std::uint64_t HostTextures::bytes() const {
  std::uint64_t bytes = (srgb_u8.size() + srgb_u16.size()) * sizeof(float) + images.size() * sizeof(ImageTable);
  for (const std::span<const std::byte> image : texels) bytes += image.size() + kTexelAlignment;
  return bytes + 3 * kTexelAlignment;
}

std::uint32_t HostTextures::features() const {
  std::uint32_t features = images.empty() ? 0 : kHasImages;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const ImageTable& image = images[i];
    features |= 1u << (kHasFormatShift + image.format);
    const std::size_t texel = texels[i].size() / (std::size_t(image.width) * image.height);
    if (texel % 4 != 0) features |= kHasUnalignedTexels;
  }
  return features;
}

Result<TextureTables> HostTextures::place(Arena& arena) const {
  const Result<std::uint64_t> u8 = arena.upload_vector(srgb_u8, "a table of sRGB values");
  if (!u8) return u8.error();
  const Result<std::uint64_t> u16 = arena.upload_vector(srgb_u16, "a table of sRGB values");
  if (!u16) return u16.error();
  std::vector<ImageTable> placed = images;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const Result<std::uint64_t> address = arena.upload(texels[i], kTexelAlignment, "the image " + names[i]);
    if (!address) return address.error();
    placed[i].texels = *address;
    placed[i].srgb = placed[i].format == kTexelU8 ? *u8 : placed[i].format == kTexelU16 ? *u16 : 0;
  }
  const Result<std::uint64_t> table = arena.upload_vector(placed, "the table of images");
  if (!table) return table.error();
  return TextureTables{.images = *table};
}

}  // namespace helio::vulkan
