// A diffuse base below a smooth or rough dielectric interface: trace/bsdf/bsdf_plastic.h.
#ifndef BSDF_PLASTIC_GLSL
#define BSDF_PLASTIC_GLSL

#include "bsdf/bsdf_values.glsl"
#include "bsdf/fresnel.glsl"
#include "bsdf/microfacet.glsl"
#include "sampling/warp.glsl"

// PlasticInterface::transmitted(), of the cosine in [0, 1].
float plastic_transmitted(PlasticBuffer plastic, float cosine) {
  if (plastic.table.smooth_interface != 0) return 1 - fresnel_dielectric(cosine, plastic.table.eta).reflectance;
  const float x = clamp(cosine, 0.0, 1.0) * float(kPlasticNodes - 1);
  const uint i = min(uint(x), kPlasticNodes - 2);
  const float t = x - float(i);
  return plastic.table.transmittance[i] * (1 - t) + plastic.table.transmittance[i + 1] * t;
}

vec3 plastic_base(PlasticBuffer plastic, vec3 color) {
  const vec3 shift = plastic.table.nonlinear != 0 ? color : vec3(1);
  const vec3 returned = plastic.table.internal_reflectance * shift;
  return color / (max(vec3(1e-6), 1 - returned) * sqr(plastic.table.eta));
}

// Probability of sampling the reflection.
float plastic_reflection_share(LobeParams params, float transmitted) {
  const float reflected = max_component(params.specular_color) * (1 - transmitted);
  const float base = max_component(params.base_color) * transmitted;
  return reflected + base > 0 ? reflected / (reflected + base) : 1.0;
}

BsdfValue evaluate_plastic(LobeParams params, vec3 wo, vec3 wi) {
  if (!(wi.z > 0)) return no_value();
  PlasticBuffer plastic = PlasticBuffer(params.plastic);
  const float entering = plastic_transmitted(plastic, wo.z), share = plastic_reflection_share(params, entering);
  const float cosine_pdf = cosine_hemisphere_pdf_w(wi.z);
  BsdfValue value;
  value.f_cos = plastic_base(plastic, params.base_color) * (entering * plastic_transmitted(plastic, wi.z) * cosine_pdf);
  value.pdf_w = (1 - share) * cosine_pdf;
  const vec3 h = wo + wi;
  const float squared = length_squared(h);
  if (plastic.table.smooth_interface != 0 || !(squared > 1e-24)) return value;
  const vec3 m = h / sqrt(squared);
  const Microfacet facets = microfacet_of(params);
  const float pdf_w = normal_density(facets, m) / (4 * projected_area(facets, wo));
  const float fresnel = fresnel_dielectric(dot(wo, m), plastic.table.eta).reflectance;
  value.f_cos += params.specular_color * (fresnel * masking(facets, wi) * pdf_w);
  value.pdf_w += share * pdf_w;
  return value;
}

BsdfSample sample_plastic(LobeParams params, vec3 wo, float u_lobe, vec2 u) {
  PlasticBuffer plastic = PlasticBuffer(params.plastic);
  const float transmitted = plastic_transmitted(plastic, wo.z);
  const float share = plastic_reflection_share(params, transmitted);
  vec3 wi;
  if (!(u_lobe < share)) {
    wi = square_to_cosine_hemisphere(u);
  } else if (plastic.table.smooth_interface != 0) {
    const vec3 weight = params.specular_color * ((1 - transmitted) / share);
    return BsdfSample(vec3(-wo.x, -wo.y, wo.z), weight, share, 1, true, false);
  } else {
    const vec3 m = sample_visible_normal(microfacet_of(params), wo, u);
    const float cos_m = dot(wo, m);
    if (!(cos_m > 0)) return no_sample();
    wi = m * (2 * cos_m) - wo;
  }
  return sample_of(wi, evaluate_plastic(params, wo, wi));
}

vec3 plastic_albedo(LobeParams params, vec3 wo) {
  PlasticBuffer plastic = PlasticBuffer(params.plastic);
  const float entering = plastic_transmitted(plastic, wo.z);
  // Diffuse light that leaves: 1 - R_i of it per round, in units of what Lambert's base returns.
  const float leaving = (1 - plastic.table.internal_reflectance) * sqr(plastic.table.eta);
  const vec3 base = plastic_base(plastic, params.base_color);
  return min(vec3(1), params.specular_color * (1 - entering) + base * (entering * leaving));
}

#endif
