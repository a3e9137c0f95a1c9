// Two materials side by side, finer than can be seen: f = (1 - weight) f_first + weight f_second. Mitsuba's
// "blendbsdf".
//
// Chosen by the weight; the density is that of the mixture. Where only one of the two is a delta, its samples are
// deltas with the probability (1 - weight) or weight times its own.
#pragma once

#include "renderer/trace/bsdf/bsdf.h"

namespace helio {

struct BlendParams {
  SurfaceParams first, second;
  float weight = 0;  // [0, 1]
};

// `wo` as in evaluate_bsdf(); params.blend set in all of these.
BsdfValue evaluate_blend(const SurfaceParams& params, const V3f& wo, const V3f& wi);
Rgb matte_blend(const SurfaceParams& params, const V3f& wo, const V3f& wi);  // of its f_cos, matte_cos() of its parts
BsdfSample sample_blend(const SurfaceParams& params, const V3f& wo, float u_lobe, const V2f& u);
bool is_pure_delta_blend(const SurfaceParams& params);
Rgb blend_albedo(const SurfaceParams& params, const V3f& wo);

}  // namespace helio
