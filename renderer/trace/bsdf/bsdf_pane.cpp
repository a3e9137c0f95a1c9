#include "renderer/trace/bsdf/bsdf_pane.h"

#include "renderer/trace/bsdf/fresnel.h"

namespace helio {

PaneBsdf::PaneBsdf(const SurfaceParams& params, bool)
    : ior_(params.ior), reflection_tint_(params.specular_color), transmission_tint_(params.base_color) {}

void PaneBsdf::look_from(const V3f& wo) {
  const float one_side = fresnel_dielectric(wo.z, ior_).reflectance;
  wo_ = wo;
  reflected_ = 2 * one_side / (1 + one_side);
}

BsdfSample PaneBsdf::sample(float u_lobe, const V2f&) const {
  BsdfSample sample;
  sample.delta = true;
  if (u_lobe < reflected_) {
    sample.wi = V3f(-wo_.x, -wo_.y, wo_.z);
    sample.weight = reflection_tint_;
    sample.pdf_w = reflected_;
  } else {
    sample.wi = -wo_;
    sample.weight = transmission_tint_;
    sample.pdf_w = 1 - reflected_;
    sample.transmitted = true;
  }
  return sample;
}

Rgb PaneBsdf::albedo() const {
  return reflection_tint_ * reflected_ + transmission_tint_ * (1 - reflected_);
}

}  // namespace helio
