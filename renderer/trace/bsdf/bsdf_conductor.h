// Smooth or rough conductor with a complex index of refraction per channel: exact Fresnel equations, from a vacuum.
//
// Tinted by specular_color. Below kDeltaAlpha a mirror. Reciprocal; loses the light that a second facet would scatter
// (microfacet_albedo.h).
#pragma once

#include "renderer/trace/bsdf/bsdf_microfacet.h"
#include "renderer/trace/bsdf/bsdf_values.h"

namespace helio {

// Conventions: see bsdf.h.
class ConductorBsdf {
 public:
  ConductorBsdf(const SurfaceParams& params, bool inside);

  // wo.z > 0. Comes before all but is_pure_delta().
  void look_from(const V3f& wo);

  bool is_pure_delta() const { return mirror_; }
  Rgb albedo() const;
  BsdfValue evaluate(const V3f& wi) const;
  Rgb matte(const V3f&) const { return {0, 0, 0}; }
  BsdfSample sample(float u_lobe, const V2f& u) const;

 private:
  Rgb reflectance(float cos_m) const;

  bool mirror_;
  float alpha_;
  Rgb eta_, k_, tint_;
  Microfacet microfacet_;
  V3f wo_{0, 0, 1};
  float projected_area_ = 1;  // of the facets that wo sees
};

}  // namespace helio
