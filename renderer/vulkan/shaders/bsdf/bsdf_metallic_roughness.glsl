// glTF materials as layered lobes: trace/bsdf/bsdf_metallic_roughness.h.
#ifndef BSDF_METALLIC_ROUGHNESS_GLSL
#define BSDF_METALLIC_ROUGHNESS_GLSL

#include "bsdf/bsdf_layered.glsl"

const float kMatchedIor = 1e-3;

LayeredLobes opaque_lobes(LobeParams params) {
  LayeredLobes lobes;
  lobes.mirror = params.alpha < kDeltaAlpha;
  lobes.facets = microfacet_of(params);
  lobes.albedo = params.albedo;
  lobes.passage = kPassageNone;
  lobes.glass = 0;
  lobes.tint = vec3(1);
  lobes.eta = 1;
  lobes.glass_f0 = vec3(0);
  lobes.glass_f90 = 1;
  lobes.exact_f0 = 0;
  lobes.reflection_tint = vec3(1);
  return lobes;
}

void set_transmission(LobeParams params, bool inside, float share, vec3 f0, inout LayeredLobes lobes) {
  lobes.glass = share;
  lobes.tint = params.base_color;
  lobes.glass_f0 = f0 * params.specular;
  lobes.glass_f90 = params.specular;
  lobes.exact_f0 = dielectric_f0(params.ior);
  // An ior of 0 has no refracted direction: such a surface lets light through as a thin wall does.
  if (params.thin != 0 || params.ior == 0) {
    lobes.passage = kPassageThin;
    lobes.eta = params.ior;
  } else if (params.ior == 1 || (!lobes.mirror && abs(params.ior - 1) < kMatchedIor)) {
    lobes.passage = kPassageStraight;
  } else {
    lobes.passage = kPassageRefract;
    lobes.eta = inside ? 1 / params.ior : params.ior;
  }
}

LayeredLobes metallic_roughness_lobes(LobeParams params, bool inside) {
  LayeredLobes lobes = opaque_lobes(params);
  const float metal = params.metallic, glass = (1 - metal) * params.transmission;
  const float opaque = (1 - metal) * (1 - params.transmission);
  const bool tinted = params.tinted_reflection != 0;
  if (tinted) lobes.reflection_tint = params.specular_color;
  const vec3 f0 = min(vec3(1), (tinted ? vec3(1) : params.specular_color) * dielectric_f0(params.ior));
  lobes.r0 = params.base_color * metal + f0 * (params.specular * opaque);
  lobes.r90 = metal + params.specular * opaque;
  lobes.metal = metal;
  lobes.metal_mean = mean_schlick(params.base_color);
  lobes.diffuse = params.base_color * opaque;
  lobes.coat_f0 = params.specular * max_component(f0);
  lobes.coat_f90 = params.specular;
  if (has_feature(kFeatureTransmission) && glass > 0) set_transmission(params, inside, glass, f0, lobes);
  return lobes;
}

LayeredLobes specular_glossiness_lobes(LobeParams params) {
  LayeredLobes lobes = opaque_lobes(params);
  lobes.r0 = params.f0;
  lobes.r90 = 1;
  lobes.coat_f0 = max_component(params.f0);
  lobes.coat_f90 = 1;
  lobes.metal = min(1.0, lobes.coat_f0);
  lobes.metal_mean = mean_schlick(params.f0);
  lobes.diffuse = params.base_color * (1 - lobes.metal);
  return lobes;
}

#endif
