// Burley's principled model: trace/bsdf/bsdf_principled.h.
#ifndef BSDF_PRINCIPLED_GLSL
#define BSDF_PRINCIPLED_GLSL

#include "bsdf/bsdf_values.glsl"
#include "bsdf/fresnel.glsl"
#include "bsdf/microfacet_albedo.glsl"
#include "sampling/warp.glsl"

const float kCoatF0 = 0.04, kCoatMaskingAlpha = 0.25;

// Generalized Trowbridge-Reitz with exponent 1, alpha in (0, 1).
float gtr1_density(float alpha, float cos_m) {
  const float a2 = alpha * alpha;
  return (a2 - 1) / (kPi * log(a2) * (1 + (a2 - 1) * cos_m * cos_m));
}

// A normal with density gtr1_density x its cosine.
vec3 sample_gtr1(float alpha, vec2 u) {
  const float a2 = alpha * alpha;
  const float cos2 = clamp((1 - pow(a2, 1 - u.y)) / (1 - a2), 0.0, 1.0);
  return vec3(unit_circle(u.x) * sqrt(1 - cos2), sqrt(cos2));
}

vec3 tint_of(vec3 color) {
  const float lum = luminance(color);
  return lum > 0 ? color / lum : vec3(1);
}

// PrincipledBsdf of trace/bsdf/bsdf_principled.h.
struct PrincipledLobes {
  PrincipledTable own;
  Microfacet facets;
  uint64_t albedo;
  vec3 base;
  float metal;
  bool inside;
  float eta, glass, diffuse, roughness, coat_alpha;
  float choose_diffuse, choose_coat, choose_facets;
};

PrincipledLobes principled_lobes(LobeParams params, bool inside) {
  PrincipledLobes lobes;
  lobes.own = params.principled;
  lobes.facets = microfacet_of(params);
  lobes.albedo = params.albedo;
  lobes.base = params.base_color;
  lobes.metal = params.metallic;
  lobes.inside = inside;
  lobes.eta = inside ? 1 / params.ior : params.ior;
  lobes.glass = (1 - lobes.metal) * params.transmission;
  lobes.diffuse = inside ? 0.0 : (1 - lobes.metal) * (1 - params.transmission);
  lobes.roughness = safe_sqrt(params.alpha);
  lobes.coat_alpha = 0.1 + (0.001 - 0.1) * lobes.own.clearcoat_gloss;
  const float coat = inside ? 0.0 : 0.25 * lobes.own.clearcoat, sum = lobes.diffuse + coat + 1;
  lobes.choose_diffuse = lobes.diffuse / sum;
  lobes.choose_coat = coat / sum;
  lobes.choose_facets = 1 - lobes.choose_diffuse - lobes.choose_coat;
  return lobes;
}

vec3 principled_reflectance(PrincipledLobes lobes, float dielectric, float schlick_m) {
  if (lobes.inside) return vec3(lobes.glass * dielectric);
  const float tinted = lobes.own.spec_tint;
  vec3 f = vec3((1 - lobes.metal) * (1 - tinted) * dielectric);
  if (lobes.metal > 0) f += (lobes.base + (vec3(1) - lobes.base) * schlick_m) * lobes.metal;
  if (tinted > 0) {
    const vec3 f0 = tint_of(lobes.base) * dielectric_f0(lobes.eta);
    f += (f0 + (vec3(1) - f0) * schlick_m) * ((1 - lobes.metal) * tinted);
  }
  return f;
}

// Probability that a facet reflects.
float principled_reflected_share(PrincipledLobes lobes, float dielectric) {
  return lobes.inside ? dielectric : 1 - lobes.glass * (1 - dielectric);
}

vec3 principled_diffuse_cos(PrincipledLobes lobes, float cos_o, float cos_i, float cos_d) {
  const float so = schlick_term(cos_o), si = schlick_term(cos_i), retro = 2 * lobes.roughness * sqr(cos_d);
  float shape = cos_i * ((1 - 0.5 * so) * (1 - 0.5 * si) + retro * (so + si + so * si * (retro - 1)));
  if (lobes.own.flatness > 0) {
    const float f90 = 0.5 * retro;
    const float fss = (1 + (f90 - 1) * so) * (1 + (f90 - 1) * si);
    const float flattened = 1.25 * (fss * (cos_i / (cos_o + cos_i) - 0.5 * cos_i) + 0.5 * cos_i);
    shape += (flattened - shape) * lobes.own.flatness;
  }
  return lobes.base * (lobes.diffuse * shape * kInvPi);
}

vec3 principled_sheen_color(PrincipledLobes lobes) {
  return lobes.own.sheen_tint > 0 ? vec3(1) + (tint_of(lobes.base) - vec3(1)) * lobes.own.sheen_tint : vec3(1);
}

// The refraction of wo into wi, as evaluate_refraction() of bsdf_layered.glsl has it.
BsdfValue principled_refraction(PrincipledLobes lobes, vec3 wo, vec3 wi) {
  if (!(lobes.glass > 0)) return no_value();
  const float eta = lobes.eta;
  const vec3 h = wo + wi * eta;
  const float squared = length_squared(h);
  if (!(squared > 1e-24) || h.z == 0) return no_value();
  const vec3 m = h * (copysign(1.0, h.z) / sqrt(squared));
  const float cos_m = dot(wo, m);
  if (!(cos_m > 0) || !(dot(wi, m) < 0)) return no_value();
  const DielectricFresnel fresnel = fresnel_dielectric(cos_m, eta);
  const float difference = (eta - 1) * (eta + 1) / (cos_m + eta * fresnel.cos_t);
  const float density_m = normal_density(lobes.facets, m) * cos_m / projected_area(lobes.facets, wo);
  const float radiance_pdf = density_m * fresnel.cos_t / sqr(difference);  // pdf / eta^2
  const float mask = masking(lobes.facets, vec3(wi.x, wi.y, -wi.z));
  return BsdfValue(sqrt(lobes.base) * (lobes.glass * (1 - fresnel.reflectance) * mask * radiance_pdf),
                   lobes.choose_facets * (1 - principled_reflected_share(lobes, fresnel.reflectance)) * sqr(eta) *
                       radiance_pdf);
}

BsdfValue principled_value(PrincipledLobes lobes, vec3 wo, vec3 wi) {
  if (wi.z < 0) return principled_refraction(lobes, wo, wi);
  const vec3 h = wo + wi;
  const float squared = length_squared(h);
  if (!(wi.z > 0) || !(squared > 1e-24)) return no_value();
  const vec3 m = h / sqrt(squared);
  const float cos_m = dot(wo, m), schlick_m = schlick_term(cos_m);
  const float dielectric = fresnel_dielectric(cos_m, lobes.eta).reflectance;
  const float pdf_m = normal_density(lobes.facets, m) / (4 * projected_area(lobes.facets, wo));
  BsdfValue value =
      BsdfValue(principled_reflectance(lobes, dielectric, schlick_m) * (masking(lobes.facets, wi) * pdf_m),
                lobes.choose_facets * principled_reflected_share(lobes, dielectric) * pdf_m);
  if (lobes.diffuse > 0) {
    value.f_cos += principled_diffuse_cos(lobes, wo.z, wi.z, cos_m);
    value.f_cos += principled_sheen_color(lobes) * (lobes.own.sheen * (1 - lobes.metal) * schlick_m * wi.z);
    value.pdf_w += lobes.choose_diffuse * cosine_hemisphere_pdf_w(wi.z);
  }
  if (lobes.choose_coat > 0) {
    const Microfacet coat = Microfacet(kGgx, kCoatMaskingAlpha, kCoatMaskingAlpha, kCoatMaskingAlpha, vec2(1, 0));
    const float density = gtr1_density(lobes.coat_alpha, m.z);
    value.f_cos += vec3(0.25 * lobes.own.clearcoat * (kCoatF0 + (1 - kCoatF0) * schlick_m) * density *
                        masking(coat, wo) * masking(coat, wi) * wi.z);
    value.pdf_w += lobes.choose_coat * density * m.z / (4 * cos_m);
  }
  return value;
}

BsdfValue evaluate_principled(LobeParams params, bool inside, vec3 wo, vec3 wi) {
  return principled_value(principled_lobes(params, inside), wo, wi);
}

BsdfSample sample_principled(LobeParams params, bool inside, vec3 wo, float u_lobe, vec2 u) {
  const PrincipledLobes lobes = principled_lobes(params, inside);
  vec3 wi;
  bool refracts = false;
  if (u_lobe < lobes.choose_diffuse) {
    wi = square_to_cosine_hemisphere(u);
  } else {
    u_lobe -= lobes.choose_diffuse;
    const bool coat = u_lobe < lobes.choose_coat;
    const vec3 m = coat ? sample_gtr1(lobes.coat_alpha, u) : sample_visible_normal(lobes.facets, wo, u);
    const float cos_m = dot(wo, m);
    if (!(cos_m > 0)) return no_sample();
    wi = m * (2 * cos_m) - wo;
    if (!coat) {
      u_lobe = min((u_lobe - lobes.choose_coat) / lobes.choose_facets, kOneMinusEpsilon);
      const DielectricFresnel fresnel = fresnel_dielectric(cos_m, lobes.eta);
      refracts = !(u_lobe < principled_reflected_share(lobes, fresnel.reflectance));
      if (refracts) wi = refracted(wo, m, cos_m, fresnel.cos_t, lobes.eta);
    }
    if (refracts ? !(wi.z < 0) : !(wi.z > 0)) return no_sample();
  }
  BsdfSample chosen = sample_of(wi, principled_value(lobes, wo, wi));
  if (refracts && chosen.pdf_w > 0) {
    chosen.transmitted = true;
    chosen.eta = lobes.eta;
  }
  return chosen;
}

vec3 principled_albedo(LobeParams params, bool inside, vec3 wo) {
  const PrincipledLobes lobes = principled_lobes(params, inside);
  const AlbedoTerms terms = directional_albedo(lobes.albedo, lobes.facets.alpha, wo.z);
  const float s = schlick_term(wo.z), dielectric = fresnel_dielectric(wo.z, lobes.eta).reflectance;
  vec3 sum = principled_reflectance(lobes, dielectric, s) * (terms.a + terms.b);
  sum += sqrt(lobes.base) * (lobes.glass * (1 - dielectric));
  sum += lobes.base * (lobes.diffuse * (1 - dielectric));
  return min(vec3(1), sum);
}

#endif
