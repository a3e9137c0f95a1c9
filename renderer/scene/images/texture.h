// Texture lookup: the value of a TextureSlot at a texture coordinate, in linear light.
//
// The reference is the bilinear interpolation of the full-resolution image, texels decoded (sRGB to linear) before they
// are filtered. Texture coordinate (0, 0) is the upper left corner of the image, texel centres lie at (i + 0.5) / width
// (glTF 2.0, 3.8.4). What a texel means is said by TextureSlot::encoding and nowhere else; alpha is always linear.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

// Linear value of an sRGB-encoded one (IEC 61966-2-1), extended to all finite values: odd around 0, beyond 1 the same
// power law.
float srgb_to_linear(float encoded);
float linear_to_srgb(float linear);

// Texture coordinates after the slot's uv_transform (KHR_texture_transform).
inline V2f transform_uv(const TextureSlot& slot, const V2f& uv) {
  const std::array<float, 6>& m = slot.uv_transform;
  return {m[0] * uv.x + m[1] * uv.y + m[2], m[3] * uv.x + m[4] * uv.y + m[5]};
}

enum class TextureFilter : std::uint8_t {
  bilinear,  // of the full image: the reference
  mip,       // trilinear in a pyramid, by the footprint of a path
};

struct TextureOptions {
  // Slots to build pyramids for (by image and encoding): one third more texels, 16 bytes each. Empty, the default:
  // none, and lookups with a footprint return the reference. Mip-mapping trades aliasing for bias: where material
  // response is not linear in the texture, and everywhere within a footprint that is isotropic though the true one is
  // not. tests/unit/scene/images/texture_mip_test.cpp measures it, `helio_bench features` in a scene.
  std::vector<TextureSlot> mip_mapped;
};

// Looks up textures of a set of images. Immutable after construction; safe to share between threads.
class TextureTable {
 public:
  // `images` must outlive the table and stay unchanged.
  explicit TextureTable(std::span<const Image> images, const TextureOptions& options = {});
  ~TextureTable();
  TextureTable(const TextureTable&) = delete;
  TextureTable& operator=(const TextureTable&) = delete;

  std::size_t size() const { return views_.size(); }

  // The reference lookup. rgb linear, a as stored; grey images give r = g = b, images without alpha a = 1. Any uv is
  // safe: coordinates that are NaN, infinite or beyond 1e9 count as 0. Precondition: slot.present() and slot.image <
  // size().
  V4f lookup(const TextureSlot& slot, const V2f& uv) const;

  // Asks for the memory that the bilinear lookup() will read: of each row the first texel, whose line of memory mostly
  // holds the second. Any uv is safe.
  void prefetch(const TextureSlot& slot, const V2f& uv) const;

  // Trilinear lookup for a square footprint of side `width_uv` in texture coordinates (before uv_transform); the
  // reference when no pyramid was built for the slot, the filter is nearest, or the footprint is at most a texel.
  V4f lookup(const TextureSlot& slot, const V2f& uv, float width_uv) const;

  // The value of one texel, decoded. 0 <= x < width, 0 <= y < height.
  V4f texel(int image, TexelEncoding encoding, int x, int y) const;

  // Mean over all texels of the decoded value: what a texture contributes on average (power of textured emission).
  V4f mean(int image, TexelEncoding encoding) const;

  // False: every texel's alpha is exactly one, so that a mask or blend with this image never lets a ray pass.
  bool has_transparency(int image) const { return views_[std::size_t(image)].transparent; }

  int width(int image) const { return views_[image].width; }
  int height(int image) const { return views_[image].height; }
  TexelFormat format(int image) const { return views_[image].format; }

  // What the table holds besides the images: pyramids and tables.
  std::size_t memory_bytes() const;

 private:
  struct View {
    const std::uint8_t* texels = nullptr;
    int width = 0, height = 0, channels = 0;
    TexelFormat format = TexelFormat::u8;
    bool transparent = false;
  };
  struct Pyramid;

  std::vector<View> views_;
  std::vector<std::array<std::unique_ptr<const Pyramid>, 2>>
      pyramids_;  // by image, encoding; empty without mip-mapping
};

}  // namespace helio
