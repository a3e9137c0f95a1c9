// A smooth, thin sheet of glass: trace/bsdf/bsdf_pane.h.
#ifndef BSDF_PANE_GLSL
#define BSDF_PANE_GLSL

#include "bsdf/bsdf_values.glsl"
#include "bsdf/fresnel.glsl"
#include "scene/surface_params.glsl"

float pane_reflectance(LobeParams params, vec3 wo) {
  const float one_side = fresnel_dielectric(wo.z, params.ior).reflectance;
  return 2 * one_side / (1 + one_side);
}

BsdfSample sample_pane(LobeParams params, vec3 wo, float u_lobe) {
  const float reflected = pane_reflectance(params, wo);
  if (u_lobe < reflected)
    return BsdfSample(vec3(-wo.x, -wo.y, wo.z), params.specular_color, reflected, 1, true, false);
  return BsdfSample(-wo, params.base_color, 1 - reflected, 1, true, true);
}

vec3 pane_albedo(LobeParams params, vec3 wo) {
  const float reflected = pane_reflectance(params, wo);
  return params.specular_color * reflected + params.base_color * (1 - reflected);
}

#endif
