// What the kernel material_queries.comp is asked and answers, for C++ and GLSL, which includes ray.glsl before.
#ifndef HELIO_TEST_MATERIAL_QUERIES_H
#define HELIO_TEST_MATERIAL_QUERIES_H

#include "renderer/vulkan/shaders/tables/materials.h"

#ifdef __cplusplus
#include "renderer/trace/accel/accel.h"

namespace helio::vulkan {
#endif

struct MaterialQuery {
  Ray ray;
  Hit hit;
};

struct MaterialAnswer {
  // evaluate_material().
  LobeParams first, second;
  uint model;
  uint mapped;  // 0 or 1
  vec3 map_normal;
  float map_alpha2, transmission, weight;
  // interpolate_normal() and surface_emission().
  vec3 shading_normal, emission;
};

#ifdef __cplusplus
static_assert(sizeof(MaterialQuery) == 68);
static_assert(sizeof(MaterialAnswer) == 2 * sizeof(LobeParams) + 56);
}  // namespace helio::vulkan
#endif

#endif
