// What the kernel texture_queries.comp is asked, for C++ and GLSL; it answers with a vec4.
#ifndef HELIO_TEST_TEXTURE_QUERIES_H
#define HELIO_TEST_TEXTURE_QUERIES_H

#include "renderer/vulkan/shaders/tables/base.h"

#ifdef __cplusplus
namespace helio::vulkan {
#endif

struct TextureQuery {
  TextureSlotTable slot;
  vec2 uv;
};

#ifdef __cplusplus
static_assert(sizeof(TextureQuery) == 44);
}  // namespace helio::vulkan
#endif

#endif
