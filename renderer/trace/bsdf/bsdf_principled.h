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

#include "renderer/trace/bsdf/bsdf.h"

namespace helio {

// wo.z > 0, params.principled set; inside: wo was inside the volume and has been mirrored.
BsdfValue evaluate_principled(const SurfaceParams& params, bool inside, const V3f& wo, const V3f& wi);
// Of its f_cos, the diffuse lobe.
Rgb matte_principled(const SurfaceParams& params, bool inside, const V3f& wo, const V3f& wi);
BsdfSample sample_principled(const SurfaceParams& params, bool inside, const V3f& wo, float u_lobe, const V2f& u);
Rgb principled_albedo(const SurfaceParams& params, bool inside, const V3f& wo);

}  // namespace helio
