// Lambert's diffuse reflection: trace/bsdf/bsdf_lambert.h.
#ifndef BSDF_LAMBERT_GLSL
#define BSDF_LAMBERT_GLSL

#include "bsdf/bsdf_values.glsl"
#include "sampling/warp.glsl"

BsdfValue evaluate_lambert(vec3 albedo, vec3 wo, vec3 wi) {
  const float pdf_w = wo.z > 0 ? cosine_hemisphere_pdf_w(wi.z) : 0.0;
  return BsdfValue(albedo * pdf_w, pdf_w);
}

BsdfSample sample_lambert(vec3 albedo, vec3 wo, vec2 u) {
  const vec3 wi = square_to_cosine_hemisphere(u);
  return BsdfSample(wi, albedo, wo.z > 0 ? cosine_hemisphere_pdf_w(wi.z) : 0.0, 1, false, false);
}

#endif
