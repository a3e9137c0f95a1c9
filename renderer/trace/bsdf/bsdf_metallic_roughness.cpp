#include "renderer/trace/bsdf/bsdf_metallic_roughness.h"

#include "renderer/trace/bsdf/bsdf_microfacet.h"
#include "renderer/trace/bsdf/fresnel.h"

namespace helio {

namespace {

void set_roughness(const SurfaceParams& params, LayeredLobes& lobes) {
  lobes.mirror = params.alpha < kDeltaAlpha;
  lobes.microfacet = microfacet_of(params);
  lobes.albedo_row = albedo_row(lobes.microfacet.distribution, lobes.microfacet.alpha);
}

void set_transmission(const SurfaceParams& params, bool inside, float share, const Rgb& f0, LayeredLobes& lobes) {
  lobes.glass = share;
  lobes.tint = params.base_color;
  lobes.glass_f0 = f0 * params.specular;
  lobes.glass_f90 = params.specular;
  lobes.exact_f0 = dielectric_f0(params.ior);
  // An ior of 0 has no refracted direction: such a surface lets light through as a thin wall does.
  if (params.thin || params.ior == 0) {
    lobes.passage = Passage::thin;
    lobes.eta = params.ior;
  } else if (params.ior == 1 || (!lobes.mirror && std::fabs(params.ior - 1) < kMatchedIor)) {
    lobes.passage = Passage::straight;
  } else {
    lobes.passage = Passage::refract;
    lobes.eta = inside ? 1 / params.ior : params.ior;
  }
}

}  // namespace

LayeredLobes metallic_roughness_lobes(const SurfaceParams& params, bool inside) {
  LayeredLobes lobes;
  set_roughness(params, lobes);
  const float metal = params.metallic, glass = (1 - metal) * params.transmission;
  const float opaque = (1 - metal) * (1 - params.transmission);
  const Rgb tinted = (params.tinted_reflection ? Rgb(1, 1, 1) : params.specular_color) * dielectric_f0(params.ior);
  if (params.tinted_reflection) lobes.reflection_tint = params.specular_color;
  const Rgb f0(std::min(1.0f, tinted.x), std::min(1.0f, tinted.y), std::min(1.0f, tinted.z));

  lobes.r0 = params.base_color * metal + f0 * (params.specular * opaque);
  lobes.r90 = metal + params.specular * opaque;
  lobes.metal = metal;
  lobes.metal_mean = mean_schlick(params.base_color);
  lobes.diffuse = params.base_color * opaque;
  lobes.coat_f0 = params.specular * max_component(f0);
  lobes.coat_f90 = params.specular;
  if (glass > 0) set_transmission(params, inside, glass, f0, lobes);
  return lobes;
}

LayeredLobes specular_glossiness_lobes(const SurfaceParams& params) {
  LayeredLobes lobes;
  set_roughness(params, lobes);
  lobes.r0 = params.f0;
  lobes.r90 = 1;
  lobes.coat_f0 = max_component(params.f0);
  lobes.coat_f90 = 1;
  lobes.metal = std::min(1.0f, lobes.coat_f0);
  lobes.metal_mean = mean_schlick(params.f0);
  lobes.diffuse = params.base_color * (1 - lobes.metal);
  return lobes;
}

LayeredBsdf::LayeredBsdf(const SurfaceParams& params, bool inside)
    : lobes_(params.model == LobeModel::specular_glossiness ? specular_glossiness_lobes(params)
                                                            : metallic_roughness_lobes(params, inside)) {}

}  // namespace helio
