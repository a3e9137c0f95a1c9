// What the kernel light_queries.comp is asked and answers, for C++ and GLSL.
#ifndef HELIO_TEST_LIGHT_QUERIES_H
#define HELIO_TEST_LIGHT_QUERIES_H

#include "renderer/vulkan/shaders/tables/base.h"

#ifdef __cplusplus
namespace helio::vulkan {
#endif

struct LightQuery {
  vec3 point, normal;
  float u_select;
  vec2 u;
  // A hit on a light, or a direction that leaves the scene.
  vec3 direction;
  uint emitter;  // kNone: none
  float distance, cos_light;
  vec2 uv;
};

struct LightAnswer {
  // sample_light().
  vec3 direction;
  float distance;
  vec3 radiance;
  float pdf_w;
  uint delta;  // 0 or 1
  float cos_light;
  uint light;
  // Of the hit: light_pdf_w_area() and emitted(); of the direction: light_pdf_w_environment(), environment_radiance().
  float pdf_w_area;
  vec3 emitted;
  float pdf_w_environment;
  vec3 environment;
};

#ifdef __cplusplus
static_assert(sizeof(LightQuery) == 68);
static_assert(sizeof(LightAnswer) == 76);
}  // namespace helio::vulkan
#endif

#endif
