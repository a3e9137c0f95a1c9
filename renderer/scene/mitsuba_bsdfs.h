// BSDF plugins as Materials.
//
//   diffuse, twosided, mask, normalmap            as Mitsuba has them
//   conductor, roughconductor                     eta and k, or a named metal; isotropic; GGX or Beckmann
//   dielectric, roughdielectric                   a surface that bounds a volume; isotropic
//
// All others are refused by name. What reflects is one-sided (black from behind) unless twosided wraps it, and so are
// conductors; dielectrics have two sides of their own.
#pragma once

#include "renderer/scene/mitsuba_context.h"

namespace helio::mitsuba {

// Read once per element. After a reported failure: some material.
Material read_bsdf(const Element& element, LoadContext& context);

// What a shape without a bsdf gets: diffuse, reflectance 0.5, one-sided.
Material default_material();

}  // namespace helio::mitsuba
