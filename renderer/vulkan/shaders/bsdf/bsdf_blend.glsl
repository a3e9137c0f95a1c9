// Two materials mixed: trace/bsdf/bsdf_blend.h. A surface of one material is a blend of weight 0 here, so that each
// model's code is there once for both.
#ifndef BSDF_BLEND_GLSL
#define BSDF_BLEND_GLSL

#include "bsdf/bsdf_lobes.glsl"

LobeParams part_of_blend(SurfaceParams params, int part) {
  if (part == 1) return params.second;
  return params.first;
}

BsdfValue evaluate_blend(SurfaceParams params, vec3 wo, vec3 wi) {
  if (!has_model(kLobeBlend)) return evaluate_lobes(params.first, wo, wi);
  BsdfValue value = no_value();
  [[dont_unroll]] for (int i = 0; i < 2; ++i) {
    const float share = i == 0 ? 1 - params.weight : params.weight;
    if (!(share > 0)) continue;
    const BsdfValue own = evaluate_lobes(part_of_blend(params, i), wo, wi);
    value.f_cos += own.f_cos * share;
    value.pdf_w += own.pdf_w * share;
  }
  return value;
}

BsdfSample sample_blend(SurfaceParams params, vec3 wo, float u_lobe, vec2 u) {
  if (!has_model(kLobeBlend)) return sample_lobes(params.first, wo, u_lobe, u);
  const bool blend = params.model == kLobeBlend, second = blend && u_lobe < params.weight;
  const float share = second ? params.weight : 1 - params.weight;
  if (blend) {
    const float rest = second ? u_lobe / share : (u_lobe - params.weight) / share;
    u_lobe = clamp(rest, 0.0, kOneMinusEpsilon);
  }
  BsdfSample chosen = sample_lobes(part_of_blend(params, second ? 1 : 0), wo, u_lobe, u);
  if (!blend || !(chosen.pdf_w > 0)) return chosen;
  const float own_pdf = chosen.pdf_w * share;
  if (chosen.delta) {
    chosen.pdf_w = own_pdf;
    return chosen;  // chosen with its share, which its part of f has too: the weight stays
  }
  BsdfValue rival = no_value();
  if (share < 1) rival = evaluate_lobes(part_of_blend(params, second ? 0 : 1), wo, chosen.wi);
  const float pdf = own_pdf + rival.pdf_w * (1 - share);
  if (!is_finite(pdf)) return no_sample();
  chosen.weight = (chosen.weight * own_pdf + rival.f_cos * (1 - share)) / pdf;
  chosen.pdf_w = pdf;
  return chosen;
}

bool is_pure_delta_blend(SurfaceParams params) {
  if (!has_model(kLobeBlend)) return is_pure_delta(params.first);
  bool pure = true;
  [[dont_unroll]] for (int i = 0; i < 2; ++i) {
    const float share = i == 0 ? 1 - params.weight : params.weight;
    if (share > 0) pure = pure && is_pure_delta(part_of_blend(params, i));
  }
  return pure;
}

vec3 blend_albedo(SurfaceParams params, vec3 wo) {
  if (!has_model(kLobeBlend)) return lobes_albedo(params.first, wo);
  vec3 albedo = vec3(0);
  [[dont_unroll]] for (int i = 0; i < 2; ++i) {
    const float share = i == 0 ? 1 - params.weight : params.weight;
    if (!(share > 0)) continue;
    albedo += lobes_albedo(part_of_blend(params, i), wo) * share;
  }
  return albedo;
}

#endif
