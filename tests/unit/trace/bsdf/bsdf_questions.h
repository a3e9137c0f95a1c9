// One question to a BSDF that is made for it.
#pragma once

#include "renderer/trace/bsdf/bsdf.h"

namespace helio::test {

inline BsdfValue evaluate_bsdf(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  return Bsdf(params, wo).evaluate(wi);
}

inline Rgb matte_cos(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  return Bsdf(params, wo).matte(wi);
}

inline BsdfSample sample_bsdf(const SurfaceParams& params, const V3f& wo, float u_lobe, const V2f& u) {
  return Bsdf(params, wo).sample(u_lobe, u);
}

inline Rgb surface_albedo(const SurfaceParams& params, const V3f& wo) {
  return Bsdf(params, wo).albedo();
}

}  // namespace helio::test
