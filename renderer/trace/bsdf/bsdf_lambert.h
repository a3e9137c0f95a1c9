// Lambert's diffuse reflection, in full in this header: the path that most hits take.
//
// f = albedo / pi above the surface (wo.z > 0 and wi.z > 0), 0 otherwise. Sampled by the cosine, so that the weight is
// the albedo. Reciprocal; loses no energy.
#pragma once

#include "renderer/trace/bsdf/bsdf_values.h"
#include "renderer/trace/bsdf/surface_params.h"
#include "renderer/trace/sampling/warp.h"

namespace helio {

inline BsdfValue evaluate_lambert(const Rgb& albedo, const V3f& wo, const V3f& wi) {
  const float pdf_w = wo.z > 0 ? cosine_hemisphere_pdf_w(wi.z) : 0.0f;
  return {albedo * pdf_w, pdf_w};
}

// `wi`: distributed by the cosine (warp.h), which callers draw for many paths at once.
inline BsdfSample sample_lambert(const Rgb& albedo, const V3f& wo, const V3f& wi) {
  BsdfSample sample;
  sample.wi = wi;
  sample.weight = albedo;
  sample.pdf_w = wo.z > 0 ? cosine_hemisphere_pdf_w(sample.wi.z) : 0.0f;
  return sample;
}

// The same for one wo. Conventions: see bsdf.h.
class LambertBsdf {
 public:
  LambertBsdf(const SurfaceParams& params, bool) : albedo_(params.base_color) {}

  // wo.z > 0. Comes before evaluate(), matte() and sample().
  void look_from(const V3f& wo) { wo_ = wo; }

  bool is_pure_delta() const { return is_black(albedo_); }
  Rgb albedo() const { return albedo_; }
  BsdfValue evaluate(const V3f& wi) const { return evaluate_lambert(albedo_, wo_, wi); }
  Rgb matte(const V3f& wi) const { return evaluate(wi).f_cos; }
  BsdfSample sample(float, const V2f& u) const { return sample_lambert(albedo_, wo_, square_to_cosine_hemisphere(u)); }

 private:
  Rgb albedo_;
  V3f wo_{0, 0, 1};
};

}  // namespace helio
