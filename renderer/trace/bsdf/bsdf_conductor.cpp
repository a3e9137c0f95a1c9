#include "renderer/trace/bsdf/bsdf_conductor.h"

#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/bsdf/microfacet_albedo.h"

namespace helio {

ConductorBsdf::ConductorBsdf(const SurfaceParams& params, bool)
    : mirror_(params.alpha < kDeltaAlpha),
      alpha_(params.alpha),
      eta_(params.eta),
      k_(params.k),
      tint_(params.specular_color),
      microfacet_(microfacet_of(params)) {}

void ConductorBsdf::look_from(const V3f& wo) {
  wo_ = wo;
  if (!mirror_) projected_area_ = microfacet_.projected_area(wo);
}

Rgb ConductorBsdf::reflectance(float cos_m) const {
  return fresnel_conductor(cos_m, eta_, k_) * tint_;
}

BsdfValue ConductorBsdf::evaluate(const V3f& wi) const {
  if (mirror_ || !(wi.z > 0)) return {};
  const V3f h = wo_ + wi;
  const float squared = length_squared(h);
  if (!(squared > 1e-24f)) return {};
  const V3f m = h / std::sqrt(squared);
  const float pdf_w = microfacet_.normal_density(m) / (4 * projected_area_);
  return {reflectance(dot(wo_, m)) * (microfacet_.masking(wi) * pdf_w), pdf_w};
}

BsdfSample ConductorBsdf::sample(float, const V2f& u) const {
  BsdfSample sample;
  if (mirror_) {
    sample.wi = V3f(-wo_.x, -wo_.y, wo_.z);
    sample.weight = reflectance(wo_.z);
    sample.pdf_w = 1;
    sample.delta = true;
    return sample;
  }
  const V3f m = microfacet_.sample_visible_normal(wo_, u);
  const float cos_m = dot(wo_, m);
  const V3f wi = m * (2 * cos_m) - wo_;
  if (!(cos_m > 0) || !(wi.z > 0)) return sample;
  sample.wi = wi;
  sample.weight = reflectance(cos_m) * microfacet_.masking(wi);
  sample.pdf_w = microfacet_.normal_density(m) / (4 * projected_area_);
  return sample;
}

Rgb ConductorBsdf::albedo() const {
  const AlbedoTerms terms = directional_albedo(microfacet_.distribution, alpha_, wo_.z);
  return reflectance(wo_.z) * (terms.a + terms.b);
}

}  // namespace helio
