// Microfacet normals: the distributions of Walter et al. 2007 ("Microfacet Models for Refraction through Rough
// Surfaces"), Smith masking and sampling of the normals that a direction sees.
//
// Local frame, z the macroscopic normal. `w` and `wo` have z >= 0, `m` is a unit microfacet normal with z > 0.
// Shadowing and masking is the separable Smith form G(wi, wo) = G1(wi) G1(wo), as in appendix B of glTF 2.0 and in
// Mitsuba 3; single scattering only: see microfacet_albedo.h for the energy that this loses.
//
// Everything is written with the projected area sigma(w) = w.z / G1(w) of the visible microsurface, which is positive
// and smooth down to w.z = 0, so that neither grazing nor normal incidence divides by zero:
//   density of visible normals  D_w(m) = D(m) max(0, w.m) / sigma(w)   (Heitz and d'Eon 2014, eq. 2)
//   reflected about m           pdf_w  = D(m) / (4 sigma(wo))
//   reflection BRDF times cos   f cos  = F G1(wi) pdf_w
#pragma once

#include "renderer/base/math.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

struct Microfacet {
  MicrofacetDistribution distribution = MicrofacetDistribution::ggx;
  float alpha = 1;  // (0, 1]; keep it at or above kDeltaAlpha of bsdf.h
  // ggx_anisotropic (Burley 2012; Heitz 2014, section 5.4) and beckmann_anisotropic (Heitz 2014, section 5.3): alpha
  // along a unit direction and across it. `alpha` above then only looks albedos up.
  float alpha_along = 1, alpha_across = 1;
  V2f along{1, 0};

  // D(m) per unit solid angle, integral of D(m) m.z over the hemisphere = 1. 0 for m.z <= 0.
  float normal_density(const V3f& m) const;
  // sigma(w) in (0, 1].
  float projected_area(const V3f& w) const;
  // Smith's G1(w) in [0, 1]: the visible share of the facets that face w.
  float masking(const V3f& w) const { return w.z > 0 ? std::min(1.0f, w.z / projected_area(w)) : 0.0f; }
  // A normal with density D_wo(m); m.z > 0 and dot(wo, m) > 0 up to rounding. u in [0, 1)^2.
  V3f sample_visible_normal(const V3f& wo, const V2f& u) const;
};

// Inverse error function on (-1, 1), relative error below 1e-5 in the centre and 4e-4 at its very ends (Giles 2012,
// "Approximating the erfinv function", single precision). Values outside are clamped into the open interval.
float inverse_erf(float x);

}  // namespace helio
