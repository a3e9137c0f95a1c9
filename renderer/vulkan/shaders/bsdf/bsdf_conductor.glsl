// Smooth or rough conductor: trace/bsdf/bsdf_conductor.h.
#ifndef BSDF_CONDUCTOR_GLSL
#define BSDF_CONDUCTOR_GLSL

#include "bsdf/bsdf_values.glsl"
#include "bsdf/fresnel.glsl"
#include "bsdf/microfacet_albedo.glsl"

vec3 conductor_reflectance(LobeParams params, float cos_m) {
  return fresnel_conductor(cos_m, params.eta, params.k) * params.specular_color;
}

BsdfValue evaluate_conductor(LobeParams params, vec3 wo, vec3 wi) {
  if (params.alpha < kDeltaAlpha || !(wi.z > 0)) return no_value();
  const vec3 h = wo + wi;
  const float squared = length_squared(h);
  if (!(squared > 1e-24)) return no_value();
  const vec3 m = h / sqrt(squared);
  const Microfacet facets = microfacet_of(params);
  const float pdf_w = normal_density(facets, m) / (4 * projected_area(facets, wo));
  return BsdfValue(conductor_reflectance(params, dot(wo, m)) * (masking(facets, wi) * pdf_w), pdf_w);
}

BsdfSample sample_conductor(LobeParams params, vec3 wo, vec2 u) {
  if (params.alpha < kDeltaAlpha)
    return BsdfSample(vec3(-wo.x, -wo.y, wo.z), conductor_reflectance(params, wo.z), 1, 1, true, false);
  const Microfacet facets = microfacet_of(params);
  const vec3 m = sample_visible_normal(facets, wo, u);
  const float cos_m = dot(wo, m);
  const vec3 wi = m * (2 * cos_m) - wo;
  if (!(cos_m > 0) || !(wi.z > 0)) return no_sample();
  const float pdf_w = normal_density(facets, m) / (4 * projected_area(facets, wo));
  return BsdfSample(wi, conductor_reflectance(params, cos_m) * masking(facets, wi), pdf_w, 1, false, false);
}

vec3 conductor_albedo(LobeParams params, vec3 wo) {
  const AlbedoTerms terms = directional_albedo(params.albedo, params.alpha, wo.z);
  return conductor_reflectance(params, wo.z) * (terms.a + terms.b);
}

#endif
