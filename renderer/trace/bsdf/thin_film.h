// Interference in a thin film over a metal or a dielectric (KHR_materials_iridescence): Belcour and Barla 2017, "A
// Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence", in the form that the extension
// gives: two orders of interference, Schlick's Fresnel terms at both interfaces, the base's index from its f0, and the
// spectrum integrated in closed form against fitted sensitivities.
//
// Reflectance depends on the cosine at the facet alone, on the side of the air: reciprocal. It is clamped to [0, 1]:
// the truncated series leaves that range a little.
#pragma once

#include "renderer/base/math.h"

namespace helio {

// cos_i in [0, 1]; film_ior >= 1; thickness in nm, >= 0 (0: as without film); base_f0 in [0, 1].
Rgb thin_film_reflectance(float cos_i, float film_ior, float thickness_nm, const Rgb& base_f0);

// A film on a metallic-roughness interface: what its parts reflect, and the part of the surface that it covers.
struct ThinFilm {
  float cover = 0;                                 // [0, 1]
  float ior = 1.3f, thickness = 0;                 // as above
  float metal = 0;                                 // share of the surface, and its f0
  Rgb metal_f0{0, 0, 0};
  float dielectric = 0;                            // share of the surface times KHR_materials_specular
  Rgb dielectric_f0{0, 0, 0};
  float glass_weight = 1;                          // KHR_materials_specular

  // `bare`: what the metal and the opaque dielectric, or the glass, reflect without film.
  Rgb over_opaque(const Rgb& bare, float cos_i) const;
  Rgb over_glass(const Rgb& bare, float cos_i) const;
  // Mean of what the metal reflects, weighed by the cosine, over the hemisphere. By 16 points in the square of the
  // cosine: off by at most 0.01 for up to a micrometre of film of ior 1.2 or more.
  Rgb mean_over_metal() const;
};

}  // namespace helio
