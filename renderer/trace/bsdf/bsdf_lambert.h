// Lambert's diffuse reflection, in full in this header: the path that most hits take.
//
// f = albedo / pi above the surface (wo.z > 0 and wi.z > 0), 0 otherwise. Sampled by the cosine, so that the weight is
// the albedo. Reciprocal; loses no energy.
#pragma once

#include "renderer/trace/bsdf/bsdf.h"
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

}  // namespace helio
