#include "renderer/trace/bsdf/bsdf_conductor.h"

#include "renderer/trace/bsdf/bsdf_microfacet.h"
#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/bsdf/microfacet_albedo.h"

namespace helio {

namespace {

Rgb reflectance(const SurfaceParams& params, float cos_m) {
  return fresnel_conductor(cos_m, params.eta, params.k) * params.specular_color;
}

}  // namespace

BsdfValue evaluate_conductor(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  if (params.alpha < kDeltaAlpha || !(wi.z > 0)) return {};
  const V3f h = wo + wi;
  const float squared = length_squared(h);
  if (!(squared > 1e-24f)) return {};
  const V3f m = h / std::sqrt(squared);
  const Microfacet microfacet = microfacet_of(params);
  const float pdf_w = microfacet.normal_density(m) / (4 * microfacet.projected_area(wo));
  return {reflectance(params, dot(wo, m)) * (microfacet.masking(wi) * pdf_w), pdf_w};
}

BsdfSample sample_conductor(const SurfaceParams& params, const V3f& wo, const V2f& u) {
  BsdfSample sample;
  if (params.alpha < kDeltaAlpha) {
    sample.wi = V3f(-wo.x, -wo.y, wo.z);
    sample.weight = reflectance(params, wo.z);
    sample.pdf_w = 1;
    sample.delta = true;
    return sample;
  }
  const Microfacet microfacet = microfacet_of(params);
  const V3f m = microfacet.sample_visible_normal(wo, u);
  const float cos_m = dot(wo, m);
  const V3f wi = m * (2 * cos_m) - wo;
  if (!(cos_m > 0) || !(wi.z > 0)) return sample;
  sample.wi = wi;
  sample.weight = reflectance(params, cos_m) * microfacet.masking(wi);
  sample.pdf_w = microfacet.normal_density(m) / (4 * microfacet.projected_area(wo));
  return sample;
}

Rgb conductor_albedo(const SurfaceParams& params, const V3f& wo) {
  const AlbedoTerms terms = directional_albedo(params.distribution, params.alpha, wo.z);
  return reflectance(params, wo.z) * (terms.a + terms.b);
}

}  // namespace helio
