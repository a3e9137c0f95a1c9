#include "renderer/trace/bsdf/bsdf_blend.h"

#include "renderer/trace/bsdf/bsdf.h"

namespace helio {

BlendBsdf::BlendBsdf(const SurfaceParams& params, const V3f& wo) : weight_(params.blend->weight) {
  if (1 - weight_ > 0) first_.emplace(params.blend->first, wo);
  if (weight_ > 0) second_.emplace(params.blend->second, wo);
}

BsdfValue BlendBsdf::evaluate(const V3f& wi) const {
  BsdfValue value;
  const auto add = [&](const Late<Part>& part, float share) {
    if (!part) return;
    const BsdfValue own = part->evaluate(wi);
    value.f_cos += own.f_cos * share;
    value.pdf_w += own.pdf_w * share;
  };
  add(first_, 1 - weight_);
  add(second_, weight_);
  return value;
}

Rgb BlendBsdf::matte(const V3f& wi) const {
  Rgb f_cos(0, 0, 0);
  if (first_) f_cos += first_->matte(wi) * (1 - weight_);
  if (second_) f_cos += second_->matte(wi) * weight_;
  return f_cos;
}

BsdfSample BlendBsdf::sample(float u_lobe, const V2f& u) const {
  const bool second = u_lobe < weight_;
  const float share = second ? weight_ : 1 - weight_;
  const float rest = second ? u_lobe / share : (u_lobe - weight_) / share;
  const Late<Part>&own = second ? second_ : first_, &other = second ? first_ : second_;
  if (!own) return {};
  BsdfSample sample = own->sample(std::clamp(rest, 0.0f, kOneMinusEpsilon), u);
  if (!sample.valid()) return sample;
  const float own_pdf = sample.pdf_w * share;
  if (sample.delta) {
    sample.pdf_w = own_pdf;
    return sample;  // chosen with its share, which its part of f has too: the weight stays
  }
  const BsdfValue rival = other ? other->evaluate(sample.wi) : BsdfValue{};
  const float pdf = own_pdf + rival.pdf_w * (1 - share);
  if (!std::isfinite(pdf)) return {};
  sample.weight = (sample.weight * own_pdf + rival.f_cos * (1 - share)) / pdf;
  sample.pdf_w = pdf;
  return sample;
}

bool BlendBsdf::is_pure_delta() const {
  return (!first_ || first_->is_pure_delta()) && (!second_ || second_->is_pure_delta());
}

Rgb BlendBsdf::albedo() const {
  Rgb albedo(0, 0, 0);
  if (first_) albedo += first_->albedo() * (1 - weight_);
  if (second_) albedo += second_->albedo() * weight_;
  return albedo;
}

bool InnerBlendBsdf::is_pure_delta() const {
  return BlendBsdf(params_, wo_).is_pure_delta();
}

Rgb InnerBlendBsdf::albedo() const {
  return BlendBsdf(params_, wo_).albedo();
}

BsdfValue InnerBlendBsdf::evaluate(const V3f& wi) const {
  return BlendBsdf(params_, wo_).evaluate(wi);
}

Rgb InnerBlendBsdf::matte(const V3f& wi) const {
  return BlendBsdf(params_, wo_).matte(wi);
}

BsdfSample InnerBlendBsdf::sample(float u_lobe, const V2f& u) const {
  return BlendBsdf(params_, wo_).sample(u_lobe, u);
}

}  // namespace helio
