// Smooth or rough conductor with a complex index of refraction per channel: exact Fresnel equations, from a vacuum.
//
// Tinted by specular_color. Below kDeltaAlpha a mirror. Reciprocal; loses the light that a second facet would scatter
// (microfacet_albedo.h).
#pragma once

#include "renderer/trace/bsdf/bsdf.h"

namespace helio {

// wo.z > 0 in all of these.
BsdfValue evaluate_conductor(const SurfaceParams& params, const V3f& wo, const V3f& wi);
BsdfSample sample_conductor(const SurfaceParams& params, const V3f& wo, const V2f& u);
Rgb conductor_albedo(const SurfaceParams& params, const V3f& wo);

}  // namespace helio
