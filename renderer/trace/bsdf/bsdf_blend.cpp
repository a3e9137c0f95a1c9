#include "renderer/trace/bsdf/bsdf_blend.h"

namespace helio {

BsdfValue evaluate_blend(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  const BlendParams& blend = *params.blend;
  BsdfValue value;
  const auto add = [&](const SurfaceParams& part, float share) {
    if (!(share > 0)) return;
    const BsdfValue own = evaluate_bsdf(part, wo, wi);
    value.f_cos += own.f_cos * share;
    value.pdf_w += own.pdf_w * share;
  };
  add(blend.first, 1 - blend.weight);
  add(blend.second, blend.weight);
  return value;
}

Rgb matte_blend(const SurfaceParams& params, const V3f& wo, const V3f& wi) {
  const BlendParams& blend = *params.blend;
  Rgb f_cos(0, 0, 0);
  if (blend.weight < 1) f_cos += matte_cos(blend.first, wo, wi) * (1 - blend.weight);
  if (blend.weight > 0) f_cos += matte_cos(blend.second, wo, wi) * blend.weight;
  return f_cos;
}

BsdfSample sample_blend(const SurfaceParams& params, const V3f& wo, float u_lobe, const V2f& u) {
  const BlendParams& blend = *params.blend;
  const bool second = u_lobe < blend.weight;
  const float share = second ? blend.weight : 1 - blend.weight;
  const float rest = second ? u_lobe / share : (u_lobe - blend.weight) / share;
  const SurfaceParams &own = second ? blend.second : blend.first, &other = second ? blend.first : blend.second;
  BsdfSample sample = sample_bsdf(own, wo, std::clamp(rest, 0.0f, kOneMinusEpsilon), u);
  if (!sample.valid()) return sample;
  const float own_pdf = sample.pdf_w * share;
  if (sample.delta) {
    sample.pdf_w = own_pdf;
    return sample;  // chosen with its share, which its part of f has too: the weight stays
  }
  const BsdfValue rival = share < 1 ? evaluate_bsdf(other, wo, sample.wi) : BsdfValue{};
  const float pdf = own_pdf + rival.pdf_w * (1 - share);
  if (!std::isfinite(pdf)) return {};
  sample.weight = (sample.weight * own_pdf + rival.f_cos * (1 - share)) / pdf;
  sample.pdf_w = pdf;
  return sample;
}

bool is_pure_delta_blend(const SurfaceParams& params) {
  const BlendParams& blend = *params.blend;
  return (!(blend.weight < 1) || is_pure_delta(blend.first)) && (!(blend.weight > 0) || is_pure_delta(blend.second));
}

Rgb blend_albedo(const SurfaceParams& params, const V3f& wo) {
  const BlendParams& blend = *params.blend;
  return surface_albedo(blend.first, wo) * (1 - blend.weight) + surface_albedo(blend.second, wo) * blend.weight;
}

}  // namespace helio
