// What the shaders read of a scene: structs that C++ and GLSL share, in scalar block layout. Large arrays are reached
// by device addresses, because a descriptor holds 128 MiB at most on some devices. Rules: members of eight bytes first,
// sizes a multiple of the largest member's alignment, no bool.
#ifndef HELIO_VULKAN_TABLES_BASE_H
#define HELIO_VULKAN_TABLES_BASE_H

#ifdef __cplusplus
#include <cstdint>

#include "renderer/base/math.h"

namespace helio::vulkan {
using uint = std::uint32_t;
using vec2 = V2f;
using vec3 = V3f;
using vec4 = V4f;
using std::uint64_t;
#define HELIO_CONSTANT inline constexpr uint
#else
#define HELIO_CONSTANT const uint
#endif

HELIO_CONSTANT kNone = 0xffffffffu;  // kNoHit, kNoLight, no texture

// A TextureSlot as shaders read it: a texture as a material or a light names it.
struct TextureSlotTable {
  uint image;  // kNone: none
  int texcoord;
  uint modes;  // wrap_s | wrap_t << 2 | nearest << 4 | encoding << 5 (textures.glsl)
  float uv_transform[6];
};

#ifdef __cplusplus
}  // namespace helio::vulkan
#endif

#endif
