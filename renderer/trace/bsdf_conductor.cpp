#include "renderer/trace/bsdf_conductor.h"

#include "renderer/trace/fresnel.h"
#include "renderer/trace/microfacet.h"
#include "renderer/trace/microfacet_albedo.h"

namespace helio {

BsdfValue evaluate_conductor(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  if (params.alpha < kDeltaAlpha || !(wi.z > 0)) return {};
  const V3f h = wo + wi;
  const float squared = length_squared(h);
  if (!(squared > 1e-24f)) return {};
  const V3f m = h / std::sqrt(squared);
  const Microfacet microfacet{params.distribution, params.alpha};
  const float pdf_w = microfacet.normal_density(m) / (4 * microfacet.projected_area(wo));
  return {fresnel_conductor(dot(wo, m), params.eta, params.k) * (microfacet.masking(wi) * pdf_w), pdf_w};
}

BsdfSample sample_conductor(const SurfaceParams& params, const V3f& wo, const V2f& u) {
  BsdfSample sample;
  if (params.alpha < kDeltaAlpha) {
    sample.wi = V3f(-wo.x, -wo.y, wo.z);
    sample.weight = fresnel_conductor(wo.z, params.eta, params.k);
    sample.pdf_w = 1;
    sample.delta = true;
    return sample;
  }
  const Microfacet microfacet{params.distribution, params.alpha};
  const V3f m = microfacet.sample_visible_normal(wo, u);
  const float cos_m = dot(wo, m);
  const V3f wi = m * (2 * cos_m) - wo;
  if (!(cos_m > 0) || !(wi.z > 0)) return sample;
  sample.wi = wi;
  sample.weight = fresnel_conductor(cos_m, params.eta, params.k) * microfacet.masking(wi);
  sample.pdf_w = microfacet.normal_density(m) / (4 * microfacet.projected_area(wo));
  return sample;
}

Rgb conductor_albedo(const SurfaceParams& params, const V3f& wo) {
  const AlbedoTerms terms = directional_albedo(params.distribution, params.alpha, wo.z);
  return fresnel_conductor(wo.z, params.eta, params.k) * (terms.a + terms.b);
}

}  // namespace helio
