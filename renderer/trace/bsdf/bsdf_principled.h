// Burley's principled model as Mitsuba 3 has it ("principled"; Burley 2012, "Physically Based Shading at Disney", and
// 2015, "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering").
//
//   facets      GGX with alpha = roughness^2, along and across divided and multiplied by sqrt(1 - 0.9 anisotropic), at
//               least 1e-3. Fresnel: exact for the dielectric, Schlick for the share spec_tint of it (tinted by the
//               base colour over its luminance) and for the metal (base colour)
//   refraction  of the share (1 - metallic) transmission, tinted by the root of the base colour per crossing
//   clearcoat   clearcoat / 4 x Schlick(0.04) x D x G x wi.z: GTR1 with alpha from 0.1 to 1e-3 by its gloss, G of GGX
//               with alpha 0.25
//   diffuse     of the share (1 - metallic) (1 - transmission): Burley's with retro-reflection, mixed by `flatness`
//               with his fit of Hanrahan and Krueger's subsurface scattering
//   sheen       sheen (1 - metallic) (1 - wi.m)^5 wi.z, white to tinted by sheen_tint; where there is a diffuse part
//
// From inside only facets and refraction are left. Reciprocal (refraction up to the squared index). An empirical model:
// it neither keeps nor is bounded by the light that arrives: a white dielectric of roughness 0.45 returns 1.04 of a
// furnace along its normal and 1.18 at a cosine of 0.1 (bsdf_mitsuba_test holds it).
#pragma once

#include "renderer/trace/bsdf/bsdf_microfacet.h"
#include "renderer/trace/bsdf/bsdf_values.h"

namespace helio {

// Conventions: see bsdf.h. Its matte part is the diffuse lobe.
class PrincipledBsdf {
 public:
  // inside: wo was inside the volume and has been mirrored.
  PrincipledBsdf(const SurfaceParams& params, bool inside);

  // wo.z > 0. Comes before all but is_pure_delta().
  void look_from(const V3f& wo);

  bool is_pure_delta() const { return false; }
  Rgb albedo() const;
  BsdfValue evaluate(const V3f& wi) const;
  Rgb matte(const V3f& wi) const;
  BsdfSample sample(float u_lobe, const V2f& u) const;

 private:
  Rgb reflectance(float dielectric, float schlick_m) const;
  // Probability that a facet reflects.
  float reflected_share(float dielectric) const { return inside_ ? dielectric : 1 - glass_ * (1 - dielectric); }
  // With the cosine cos_i, which keeps the flat part finite at the horizon. cos_d: between the half vector and either
  // direction.
  Rgb diffuse_cos(float cos_i, float cos_d) const;
  Rgb sheen_color() const;
  BsdfValue refraction(const V3f& wi) const;
  BsdfSample reflect_about(const V3f& m) const;
  BsdfSample finish(const V3f& wi) const { return sample_of(wi, evaluate(wi)); }

  const PrincipledMaterial p_;
  const Rgb base_;
  const float metal_;
  const bool inside_;
  const Microfacet facets_;
  float eta_ = 1, glass_ = 0, diffuse_ = 0, roughness_ = 1, coat_alpha_ = 0.1f;
  float choose_diffuse_ = 0, choose_coat_ = 0, choose_facets_ = 1;
  V3f wo_{0, 0, 1};
  float projected_area_ = 1;  // of the facets that wo sees
};

}  // namespace helio
