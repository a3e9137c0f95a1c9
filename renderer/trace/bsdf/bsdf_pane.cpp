#include "renderer/trace/bsdf/bsdf_pane.h"

#include "renderer/trace/bsdf/fresnel.h"

namespace helio {

namespace {

float pane_reflectance(const SurfaceParams& params, const V3f& wo) {
  const float one_side = fresnel_dielectric(wo.z, params.ior).reflectance;
  return 2 * one_side / (1 + one_side);
}

}  // namespace

BsdfSample sample_pane(const SurfaceParams& params, const V3f& wo, float u_lobe) {
  const float reflected = pane_reflectance(params, wo);
  BsdfSample sample;
  sample.delta = true;
  if (u_lobe < reflected) {
    sample.wi = V3f(-wo.x, -wo.y, wo.z);
    sample.weight = params.specular_color;
    sample.pdf_w = reflected;
  } else {
    sample.wi = -wo;
    sample.weight = params.base_color;
    sample.pdf_w = 1 - reflected;
    sample.transmitted = true;
  }
  return sample;
}

Rgb pane_albedo(const SurfaceParams& params, const V3f& wo) {
  const float reflected = pane_reflectance(params, wo);
  return params.specular_color * reflected + params.base_color * (1 - reflected);
}

}  // namespace helio
