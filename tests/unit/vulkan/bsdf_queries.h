// What the kernel bsdf_queries.comp is asked and answers, for C++ and GLSL.
#ifndef HELIO_TEST_BSDF_QUERIES_H
#define HELIO_TEST_BSDF_QUERIES_H

#include "renderer/vulkan/shaders/tables/materials.h"

#ifdef __cplusplus
namespace helio::vulkan {
#endif

struct BsdfQuery {
  LobeParams first, second;  // `second`: of a blend
  uint model;                // as in SurfaceParams, with the following
  float transmission;
  uint mapped;  // 0 or 1
  vec3 map_normal;
  float map_alpha2, weight;

  vec3 wo, wi;  // wi: what evaluate_bsdf() is asked
  float u_lobe;
  vec2 u;
  uint padding;
};

struct BsdfAnswer {
  // evaluate_bsdf().
  vec3 f_cos;
  float pdf_w;
  // sample_bsdf().
  vec3 wi, weight;
  float sampled_pdf_w, eta;
  uint delta, transmitted;  // 0 or 1
  vec3 albedo;
  uint pure_delta;  // 0 or 1
};

#ifdef __cplusplus
static_assert(sizeof(BsdfQuery) == 2 * sizeof(LobeParams) + 72);
static_assert(sizeof(BsdfAnswer) == 72);
}  // namespace helio::vulkan
#endif

#endif
