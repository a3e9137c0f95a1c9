#include "renderer/trace/bsdf/bsdf.h"

namespace helio {

namespace {

V3f mirrored(const V3f& w) {
  return {w.x, w.y, -w.z};
}

// Smith's masking of wi by the facets that a normal map stands for (Conty Estevez, Lecocq and Stein 2019, "A
// Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem").
float map_shadowing(float alpha2, const V3f& wi) {
  const float cos2 = wi.z * wi.z;
  if (!(cos2 > 0)) return 0;
  return 2 / (1 + std::sqrt(1 + alpha2 * std::max(0.0f, 1 - cos2) / cos2));
}

// The unmapped and the mapped surface agree on the side that a direction lies on.
bool same_side(const V3f& unmapped, const V3f& mapped) {
  return unmapped.z * mapped.z > 0;
}

}  // namespace

template <class Blend>
BsdfOf<Blend>::BsdfOf(const SurfaceParams& params, const V3f& wo)
    : mapped_(params.mapped), map_alpha2_(params.map_alpha2) {
  V3f own = wo;
  if (mapped_) {
    map_ = Frame(params.map_normal);
    own = map_.to_local(wo);
  }
  // Only a surface that bounds a volume is seen from below.
  side_ = own.z > 0 ? Side::outside : own.z < 0 && !params.thin ? Side::inside : Side::none;
  switch (params.model) {
    case LobeModel::lambert:
      start<LambertBsdf>(params, own);
      break;
    case LobeModel::metallic_roughness:
    case LobeModel::specular_glossiness:
      start<LayeredBsdf>(params, own);
      break;
    case LobeModel::conductor:
      start<ConductorBsdf>(params, own);
      break;
    case LobeModel::stack:
      start<StackBsdf>(params, own);
      break;
    case LobeModel::plastic:
      start<PlasticBsdf>(params, own);
      break;
    case LobeModel::pane:
      start<PaneBsdf>(params, own);
      break;
    case LobeModel::principled:
      start<PrincipledBsdf>(params, own);
      break;
    case LobeModel::blend:  // its parts know their own sides
      side_ = Side::outside;
      model_.template emplace<Blend>(params, own);
      break;
    case LobeModel::none:
      break;
  }
}

template <class Blend>
template <class Model>
void BsdfOf<Blend>::start(const SurfaceParams& params, const V3f& wo) {
  const bool inside = side_ == Side::inside;
  Model& model = model_.template emplace<Model>(params, inside);
  if (side_ != Side::none) model.look_from(inside ? mirrored(wo) : wo);
}

template <class Blend>
bool BsdfOf<Blend>::is_pure_delta() const {
  return std::visit([](const auto& model) { return model.is_pure_delta(); }, model_);
}

template <class Blend>
Rgb BsdfOf<Blend>::albedo() const {
  if (side_ == Side::none) return {0, 0, 0};
  return std::visit([](const auto& model) { return model.albedo(); }, model_);
}

template <class Blend>
BsdfValue BsdfOf<Blend>::evaluate_unmapped(const V3f& wi) const {
  if (side_ == Side::none) return {};
  const V3f own = side_ == Side::inside ? mirrored(wi) : wi;
  return std::visit([&](const auto& model) { return model.evaluate(own); }, model_);
}

template <class Blend>
Rgb BsdfOf<Blend>::matte_unmapped(const V3f& wi) const {
  if (side_ == Side::none) return {0, 0, 0};
  const V3f own = side_ == Side::inside ? mirrored(wi) : wi;
  return std::visit([&](const auto& model) { return model.matte(own); }, model_);
}

template <class Blend>
BsdfSample BsdfOf<Blend>::sample_unmapped(float u_lobe, const V2f& u) const {
  if (side_ == Side::none) return {};
  BsdfSample sample = std::visit([&](const auto& model) { return model.sample(u_lobe, u); }, model_);
  if (side_ == Side::inside) sample.wi = mirrored(sample.wi);
  return sample;
}

template <class Blend>
BsdfValue BsdfOf<Blend>::evaluate(const V3f& wi) const {
  if (!mapped_) return evaluate_unmapped(wi);
  const V3f own_wi = map_.to_local(wi);
  if (!same_side(wi, own_wi)) return {};
  BsdfValue value = evaluate_unmapped(own_wi);
  if (map_alpha2_ > 0) value.f_cos *= map_shadowing(map_alpha2_, wi);
  return value;
}

template <class Blend>
BsdfValue BsdfOf<Blend>::evaluate_back(const SurfaceParams& params, const V3f& wo, const V3f& wi) const {
  if (const LayeredBsdf* one = layered(); one && wi.z > 0)
    return evaluate_layered_back(one->lobes(), one->view(), wi);
  return BsdfOf<Blend>(params, wi).evaluate(wo);
}

template <class Blend>
BsdfBothWays BsdfOf<Blend>::evaluate_both_ways(const SurfaceParams& params, const V3f& wo, const V3f& wi) const {
  if (const LayeredBsdf* one = layered(); one && wi.z > 0)
    return evaluate_layered_both_ways(one->lobes(), one->view(), wi);
  return {evaluate(wi), evaluate_back(params, wo, wi)};
}

template <class Blend>
Rgb BsdfOf<Blend>::matte(const V3f& wi) const {
  if (!mapped_) return matte_unmapped(wi);
  const V3f own_wi = map_.to_local(wi);
  if (!same_side(wi, own_wi)) return {0, 0, 0};
  const Rgb f_cos = matte_unmapped(own_wi);
  return map_alpha2_ > 0 ? f_cos * map_shadowing(map_alpha2_, wi) : f_cos;
}

template <class Blend>
BsdfSample BsdfOf<Blend>::sample(float u_lobe, const V2f& u) const {
  BsdfSample sample = sample_unmapped(u_lobe, u);
  if (!mapped_ || !sample.valid()) return sample;
  const V3f own_wi = sample.wi;
  sample.wi = map_.to_world(own_wi);
  if (!same_side(sample.wi, own_wi)) return {};
  if (map_alpha2_ > 0) sample.weight *= map_shadowing(map_alpha2_, sample.wi);
  return sample;
}

template class BsdfOf<InnerBlendBsdf>;
template class BsdfOf<BlendBsdf>;

}  // namespace helio
