// Lambert's diffuse reflection, in full in this header: the path that most hits take.
//
// f = albedo / pi above the surface (wo.z > 0 and wi.z > 0), 0 otherwise. Sampled by the cosine, so that the weight is
// the albedo. Reciprocal; loses no energy.
#pragma once

#include "renderer/trace/bsdf.h"
#include "renderer/trace/warp.h"

namespace helio {

inline BsdfValue evaluate_lambert(const Rgb& albedo, const V3f& wo, const V3f& wi) {
  const float pdf_w = wo.z > 0 ? cosine_hemisphere_pdf_w(wi.z) : 0.0f;
  return {albedo * pdf_w, pdf_w};
}

inline BsdfSample sample_lambert(const Rgb& albedo, const V3f& wo, const V2f& u) {
  BsdfSample sample;
  sample.wi = square_to_cosine_hemisphere(u);
  sample.weight = albedo;
  sample.pdf_w = wo.z > 0 ? cosine_hemisphere_pdf_w(sample.wi.z) : 0.0f;
  return sample;
}

}  // namespace helio
