// Clearcoat over sheen over a metallic-roughness base that may be anisotropic, iridescent and diffusely transmissive:
// KHR_materials_clearcoat, _sheen, _anisotropy, _iridescence, _diffuse_transmission.
//
//   f = c f_coat + t_c s f_sheen + t f_base
//
// Layers are combined by albedo scaling as the sheen extension does: with T(w) = 1 - albedo of the layers above, t is
// min(T(wo), T(wi)), which is reciprocal and lets no more through than was not reflected. The clearcoat extension
// scales by the viewer's direction alone, which is not reciprocal. A ray that crosses the boundary of a volume passes
// the layers on the outside once; inside there are none. A thin surface has them on both sides.
//
//   coat          GGX, ior 1.5 (Schlick, f0 0.04), its own normal, no diffuse base
//   sheen         bsdf_sheen.h
//   anisotropy    alpha along the direction: mix(alpha, 1, strength^2), across: alpha
//   iridescence   thin_film.h in place of the Fresnel term of reflection, thin_film_base.h over diffuse bases
//   diffuse transmission: the base's diffuse part goes to the far side by this share: colour / pi, under the same
//                 interface (bsdf_layered.h) on both sides
//
// What a white furnace gets back is in scenes/README.md, printed by the test BsdfStack.LossesAreAsDocumented.
#pragma once

#include "renderer/base/late.h"
#include "renderer/trace/bsdf/bsdf_layered.h"
#include "renderer/trace/bsdf/surface_params.h"

namespace helio {

// The layers of one surface, with the choice between them for one wo. Conventions: see bsdf.h. Its matte part is that
// of the base, and diffuse transmission.
class StackBsdf {
 public:
  // params.layers is set; inside: wo was inside the volume and has been mirrored.
  StackBsdf(const SurfaceParams& params, bool inside);
  StackBsdf(const StackBsdf&) = delete;  // base_ points to film_ and filmed_base_
  StackBsdf& operator=(const StackBsdf&) = delete;

  // wo.z > 0. Comes before all but is_pure_delta().
  void look_from(const V3f& wo);

  bool is_pure_delta() const;
  Rgb albedo() const;
  BsdfValue evaluate(const V3f& wi) const;
  Rgb matte(const V3f& wi) const;
  BsdfSample sample(float u_lobe, const V2f& u) const;

 private:
  // 1 - albedo of the coat, and of coat and sheen, towards w on either side of the surface; and the albedos of each
  // alone, where there is one.
  struct Passing {
    float coat = 1, both = 1;
    float coat_albedo = 0, sheen_albedo = 0;
  };
  Passing passing(const V3f& w) const;
  // What the layers let through on the way between wo and wi; albedos are towards wi.
  Passing shared(const V3f& wi) const;

  float coat_albedo(const V3f& w) const;
  bool coated() const { return coat_ > 0 && !inside_; }
  bool has_sheen() const { return sheen_max_ > 0 && !inside_; }

  // passed: shared(wi).
  BsdfValue base_value(const V3f& wi, const Passing& passed) const;
  BsdfValue coat_value(const V3f& wi) const;
  BsdfValue sheen_value(const V3f& wi, const Passing& passed) const;
  BsdfValue far_diffuse_value(const V3f& wi, const Passing& passed) const;
  BsdfSample finish(const V3f& wi) const;
  BsdfSample sample_base(float u_lobe, const V2f& u) const;
  BsdfSample sample_coat(const V2f& u) const;

  const bool inside_, thin_;
  LayeredLobes base_;
  ThinFilm film_;
  Late<FilmedBase> filmed_base_;
  Rgb far_diffuse_{0, 0, 0};
  float coat_ = 0, coat_alpha_ = 0;
  Frame coat_frame_;  // about its normal
  Rgb sheen_{0, 0, 0};
  float sheen_max_ = 0, sheen_alpha_ = 1;

  // For the current wo.
  V3f wo_{0, 0, 1};
  LayeredView base_view_;
  Rgb base_albedo_{0, 0, 0};
  Passing from_;  // towards wo
  float choose_coat_ = 0, choose_sheen_ = 0, choose_far_ = 0, choose_base_ = 1;
  Rgb far_entry_{0, 0, 0};
};

}  // namespace helio
