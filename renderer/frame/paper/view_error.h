// What a surface reflects after the viewer has moved: the third validation of reprojection as published (Schalk 2018,
// section 3.2.1).
//
// The paper's materials are a microfacet term fr (eq. 13) times a colour A. Ours hold their colours in their BSDF, of
// which there are several, so fr A is read as the BSDF without its delta lobes; what of it does not depend on the view
// cancels. Directions are unit vectors of the local shading frame, as in bsdf.h.
#pragma once

#include "renderer/trace/bsdf/surface_params.h"

namespace helio {

// Roughness below which a material is specular for the paper; larger than kDeltaAlpha.
inline constexpr float kSpecularAlpha = 0.01f;

// Specular or refractive: some lobe's alpha is below kSpecularAlpha, or light passes through. What such a surface
// showed is not reprojected.
bool is_specular_or_refractive(const SurfaceParams& params);

// Eq. 15: |fr(V_t, L, N) - fr(V_t-1, L, N)| A Ir, radiance, the largest channel. `irradiance`: Ir, FirstHitSample's,
// mean over a pixel's samples. +infinity where the two views are on different sides of the surface, and where anything
// is not finite.
float view_error(const SurfaceParams& params, const V3f& now, const V3f& before, const V3f& towards,
                 const Rgb& irradiance);

}  // namespace helio
