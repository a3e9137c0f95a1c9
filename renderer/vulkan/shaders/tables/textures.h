// Images in device memory, as textures.glsl reads them. Made by scene/texture_tables.cpp.
#ifndef HELIO_VULKAN_TABLES_TEXTURES_H
#define HELIO_VULKAN_TABLES_TEXTURES_H

#include "base.h"

#ifdef __cplusplus
namespace helio::vulkan {
#endif

// Values of ImageTable::format: TexelFormat.
HELIO_CONSTANT kTexelU8 = 0u, kTexelU16 = 1u, kTexelF16 = 2u, kTexelF32 = 3u;

// Bits of TextureSlotTable::modes: WrapMode along u and, from kWrapVShift on, along v; FilterMode; TexelEncoding.
HELIO_CONSTANT kWrapRepeat = 0u, kWrapClamp = 1u, kWrapMirror = 2u, kWrapMask = 3u, kWrapVShift = 2u;
HELIO_CONSTANT kFilterNearest = 16u, kEncodingSrgb = 32u;

// Bits of the specialisation constant kLightFeatures (light_features.glsl) that say what images a scene has.
HELIO_CONSTANT kHasImages = 1u << 16;
HELIO_CONSTANT kHasUnalignedTexels = 1u << 17;  // of one, two, three or six bytes
HELIO_CONSTANT kHasFormatShift = 18u;           // from here on a bit for each format

// An Image: texels as the host stores them, row 0 on top. Shaders read it by two loads of four words.
struct ImageTable {
  uint64_t texels;
  uint64_t srgb;  // float[256] or float[65536]: linear values of sRGB-encoded codes; 0 for floats
  uint width, height;
  uint channels, format;
};

struct TextureTables {
  uint64_t images;  // ImageTable[]
};

#ifdef __cplusplus
static_assert(sizeof(TextureSlotTable) == 36);
static_assert(sizeof(ImageTable) == 32);
static_assert(sizeof(TextureTables) == 8);
}  // namespace helio::vulkan
#endif

#endif
