// A diffuse base below a smooth or rough dielectric interface: Mitsuba's "plastic" and "roughplastic".
//
//   f cos = s F D G / (4 wo.z)  +  d / (1 - R_i d') T(wo) T(wi) / eta^2  wi.z / pi
//
// s = specular_color, d = base_color, d' = 1, or d where nonlinear. T(w) is the share of light from w that the
// interface lets in: 1 - F smooth; rough what its facets transmit in single scattering. R_i is the share of diffuse
// light from below that the interface sends back: light that leaves the base is 1 / eta^2 T to the outside, the rest
// returns to the base, as often as it takes. Smooth and white, all that the interface lets in comes back. A rough
// interface loses what a second facet would scatter, most of it inside, where R_i is too small for it: a white furnace
// gets back 0.75 to 0.80 at alpha 0.2 (bsdf_mitsuba_test holds it). Reciprocal.
//
// `ior` is inside over outside, >= 1. Isotropic. Reflection and base are chosen by their albedos.
#pragma once

#include <array>
#include <memory>

#include "renderer/trace/bsdf/bsdf_microfacet.h"
#include "renderer/trace/bsdf/bsdf_values.h"

namespace helio {

// What the interface does with diffuse light. Rough: tables over the cosine, as Mitsuba's of 64 equidistant nodes; R_i
// is the mean over the same nodes, whose rule of quadrature (no halved ends) is part of the model: exact integration
// would brighten a white base by 3 %.
struct PlasticInterface {
  static constexpr int kNodes = 64;
  bool nonlinear = false;
  bool smooth = true;
  float eta = 1.5f;
  float internal_reflectance = 0;
  std::array<float, kNodes> transmittance{};  // rough

  // T(w) above, of the cosine in [0, 1].
  float transmitted(float cosine) const;
};

// alpha below kDeltaAlpha: smooth. Costs up to 50 ms where it is rough.
std::shared_ptr<const PlasticInterface> make_plastic_interface(MicrofacetDistribution distribution, float alpha,
                                                               float ior, bool nonlinear);

// Share of diffuse light below an interface of relative index `ior` >= 1 that it sends back. From the outside the mean
// is that of Fresnel's equations over the cosine; inside and outside let the same flux pass: 1 - R_i = (1 - R_e) /
// ior^2.
float diffuse_internal_reflectance(float ior);

// Conventions: see bsdf.h. Its matte part is the diffuse base.
class PlasticBsdf {
 public:
  // params.plastic is set, and outlives this.
  PlasticBsdf(const SurfaceParams& params, bool inside);

  // wo.z > 0. Comes before all but is_pure_delta().
  void look_from(const V3f& wo);

  bool is_pure_delta() const;
  Rgb albedo() const;
  BsdfValue evaluate(const V3f& wi) const;
  Rgb matte(const V3f& wi) const;
  BsdfSample sample(float u_lobe, const V2f& u) const;

 private:
  float reflection_share() const;

  const PlasticInterface& interface_;
  const bool mirror_;
  const Rgb tint_, color_;
  const Rgb base_;  // d / (1 - R_i d') / eta^2 above
  const Microfacet microfacet_;
  V3f wo_{0, 0, 1};
  float projected_area_ = 1;  // of the facets that wo sees
  float entering_ = 0;        // T(wo)
  float share_ = 0;           // probability of sampling the reflection
};

}  // namespace helio
