// Scattering at a surface point: a closed set of lobes chosen by the material's evaluated parameters.
//
// Directions are unit vectors in the local shading frame (z is the shading normal), pointing away from the surface.
// z > 0 is the outside (front face) for materials that bound a volume; opaque and thin materials are two-sided: wo is
// flipped to z > 0 by the caller's choice of frame, never in here.
#pragma once

#include <variant>

#include "renderer/base/late.h"
#include "renderer/trace/bsdf/bsdf_blend.h"
#include "renderer/trace/bsdf/bsdf_conductor.h"
#include "renderer/trace/bsdf/bsdf_lambert.h"
#include "renderer/trace/bsdf/bsdf_metallic_roughness.h"
#include "renderer/trace/bsdf/bsdf_pane.h"
#include "renderer/trace/bsdf/bsdf_plastic.h"
#include "renderer/trace/bsdf/bsdf_principled.h"
#include "renderer/trace/bsdf/bsdf_stack.h"

namespace helio {

// Scatters nothing: LobeModel::none.
struct BlackBsdf {
  bool is_pure_delta() const { return true; }
  Rgb albedo() const { return {0, 0, 0}; }
  BsdfValue evaluate(const V3f&) const { return {}; }
  Rgb matte(const V3f&) const { return {0, 0, 0}; }
  BsdfSample sample(float, const V2f&) const { return {}; }
};

// The scattering of one surface point as one direction wo sees it. The lobes, and what depends on wo alone, are worked
// out once, for all questions. Blend: the class that answers for LobeModel::blend.
template <class Blend>
class BsdfOf {
 public:
  // Keeps no reference to `params` itself, but to its `plastic`, and to the parameters of blends within its `blend`.
  BsdfOf(const SurfaceParams& params, const V3f& wo);
  BsdfOf(const BsdfOf&) = delete;
  BsdfOf& operator=(const BsdfOf&) = delete;

  // True when every lobe is a delta: next-event estimation cannot contribute. Does not depend on wo.
  bool is_pure_delta() const;

  // Approximate hemispherical-directional reflectance + transmittance for the albedo feature, [0, 1].
  Rgb albedo() const;

  BsdfValue evaluate(const V3f& wi) const;

  // evaluate(wo) of the Bsdf along `wi`, to the bit, and evaluate(wi) with it. `params`, `wo`: those that this was made
  // of.
  BsdfValue evaluate_back(const SurfaceParams& params, const V3f& wo, const V3f& wi) const;
  BsdfBothWays evaluate_both_ways(const SurfaceParams& params, const V3f& wo, const V3f& wi) const;

  // The part of f_cos due to diffuse lobes, which varies little with the view direction. In all models but
  // `principled` it is a sum of a few products g(wo) h(wi).
  Rgb matte(const V3f& wi) const;

  // u_lobe and u in [0, 1). An invalid sample (pdf_w == 0) ends the path: the direction fell below the surface.
  BsdfSample sample(float u_lobe, const V2f& u) const;

  // The model, if it has but one interface and is seen from outside in the frame of the surface; null otherwise.
  const LayeredBsdf* layered() const {
    return !mapped_ && side_ == Side::outside ? std::get_if<LayeredBsdf>(&model_) : nullptr;
  }

 private:
  enum class Side : std::uint8_t { outside, inside, none };

  template <class Model>
  void start(const SurfaceParams& params, const V3f& wo);
  // The same without the map's frame.
  BsdfValue evaluate_unmapped(const V3f& wi) const;
  Rgb matte_unmapped(const V3f& wi) const;
  BsdfSample sample_unmapped(float u_lobe, const V2f& u) const;

  const bool mapped_;
  const float map_alpha2_;
  Frame map_;
  Side side_;
  std::variant<BlackBsdf, LambertBsdf, LayeredBsdf, ConductorBsdf, StackBsdf, PlasticBsdf, PaneBsdf, PrincipledBsdf,
               Blend>
      model_;
};

// A blend within a blend, which is rare: made anew for each question.
class InnerBlendBsdf {
 public:
  InnerBlendBsdf(const SurfaceParams& params, const V3f& wo) : params_(params), wo_(wo) {}

  bool is_pure_delta() const;
  Rgb albedo() const;
  BsdfValue evaluate(const V3f& wi) const;
  Rgb matte(const V3f& wi) const;
  BsdfSample sample(float u_lobe, const V2f& u) const;

 private:
  const SurfaceParams& params_;
  const V3f wo_;
};

// The two materials of a blend; absent where their share is 0. `wo` as in BsdfOf, params.blend set.
class BlendBsdf {
 public:
  BlendBsdf(const SurfaceParams& params, const V3f& wo);

  bool is_pure_delta() const;
  Rgb albedo() const;
  BsdfValue evaluate(const V3f& wi) const;
  Rgb matte(const V3f& wi) const;
  BsdfSample sample(float u_lobe, const V2f& u) const;

 private:
  using Part = BsdfOf<InnerBlendBsdf>;

  const float weight_;
  Late<Part> first_, second_;
};

extern template class BsdfOf<InnerBlendBsdf>;
extern template class BsdfOf<BlendBsdf>;

class Bsdf : public BsdfOf<BlendBsdf> {
 public:
  using BsdfOf<BlendBsdf>::BsdfOf;
};

// BsdfOf::is_pure_delta(), without wo.
inline bool is_pure_delta(const SurfaceParams& params) {
  return Bsdf(params, V3f(0, 0, 0)).is_pure_delta();
}

}  // namespace helio
