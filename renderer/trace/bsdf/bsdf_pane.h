// A sheet of glass, smooth and thin, both of its sides in one surface: Mitsuba's "thindielectric".
//
// All orders of reflection inside of the sheet add up: with R the Fresnel reflectance of one side and T = 1 - R,
// R + T R T + T R^3 T + ... = 2 R / (1 + R); the rest passes unbent. Both parts are deltas, chosen by their share, and
// tinted by specular_color and base_color. Reciprocal; white, it loses nothing. A single interface that passes light
// unbent is metallic-roughness with transmission instead (bsdf_layered.h).
#pragma once

#include "renderer/trace/bsdf/bsdf.h"

namespace helio {

// wo.z > 0 in both.
BsdfSample sample_pane(const SurfaceParams& params, const V3f& wo, float u_lobe);
Rgb pane_albedo(const SurfaceParams& params, const V3f& wo);

}  // namespace helio
