// BSDF plugins as Materials.
//
//   twosided (one or two bsdfs), mask, normalmap, bumpmap, blendbsdf    here
//   what scatters by itself                                             mitsuba/bsdf_models.h
//
// All others are refused by name. What reflects is one-sided (black from behind) unless twosided wraps it; dielectrics
// have two sides of their own. Normal and bump maps: one around a whole, or one around each part of a blend.
#pragma once

#include "renderer/scene/mitsuba/context.h"

namespace helio::mitsuba {

// Read once per element. After a reported failure: some material.
Material read_bsdf(const Element& element, LoadContext& context);

// What a shape without a bsdf gets: diffuse, reflectance 0.5, one-sided.
Material default_material();
// And one that shines: black. Mitsuba 3 gives lamps a diffuse of reflectance 0.
Material lamp_material();

}  // namespace helio::mitsuba
