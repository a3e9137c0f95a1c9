// The scattering of glTF materials: one rough or smooth interface over a base.
//
// Five parts, all of which may be present:
//   reflection     microfacet lobe; Fresnel term = Schlick part (metal, opaque dielectric) + exact dielectric part
//   rescattered    what facets of metal send to one another before it leaves
//   diffuse base   Lambert under the interface
//   transmission   the same microfacets, through a thin wall or refracted into the volume
//   straight       the interface has the index of its surroundings: light passes unbent whatever the roughness
//
// Diffuse base. fresnel_mix of glTF's appendix B weights it by 1 - F(wo.m), which adds up to almost twice the incident
// light at grazing angles. Here it is weighted by what the interface lets in and out (Kelemen and Szirmay-Kalos 2001),
//   f = base / pi T(wo) T(wi) / T_mean,
// with T = AlbedoTerms::entering of microfacet_albedo.h: reciprocal, and a white base returns all the light that the
// interface lets in. A white furnace over plain glTF plastic stays within 0.996 and 1.002, the latter from the tables.
// Under a film T is thin_film_base.h's.
//
// Rescattered light of metal (Kulla and Conty 2017, "Revisiting Physically Based Shading at Imageworks"), with the
// albedo E of the facets for F = 1 and its mean over the hemisphere,
//   f = metal F_ms (1 - E(wo)) (1 - E(wi)) / (pi (1 - E_mean)),   F_ms = F_mean^2 E_mean / (1 - F_mean (1 - E_mean)),
// the latter in Hill's form (2018, "A Multifaceted Exploration"): reciprocal, and white metal of any roughness returns
// all that it gets. For anisotropic facets E is that of their geometric mean and F_ms is scaled by the root of the
// smaller alpha over the larger: E itself would need two more dimensions, and without the factor white metal would
// return up to 1.03. Glass has no such term.
//
// Transmission scales radiance by 1 / eta^2 on the way of the camera path from this side to a medium of relative
// index eta, and so by eta^2 on the way out: these are radiance factors (Veach 1997, 5.2); powers are eta^2 times that.
// Reciprocity: f(wo, wi) = f(wi, wo) for reflection and thin walls, f(wo, wi) / n_o^2 = f(wi, wo) / n_i^2 for
// refraction.
//
// Reflection and transmission share one sampled normal; between the two the choice is by their Fresnel terms there.
// Samples below the horizon, whose light would meet a second facet, are invalid.
#pragma once

#include "renderer/trace/bsdf/bsdf_values.h"
#include "renderer/trace/bsdf/microfacet.h"
#include "renderer/trace/bsdf/thin_film_base.h"

namespace helio {

// How light gets through the interface where it is transmitted.
enum class Passage : std::uint8_t { none, thin, refract, straight };

struct LayeredLobes {
  Microfacet microfacet;  // alpha 0: mirror
  AlbedoRow albedo_row;   // of its distribution and alpha
  bool mirror = false;    // reflection and transmission are deltas

  // Schlick part of the reflection: r0 + (r90 - r0) (1 - cos)^5.
  Rgb r0{0, 0, 0};
  float r90 = 0;

  // Share of the surface whose facets rescatter, and its F_mean; under a film F_mean is the film's.
  float metal = 0;
  Rgb metal_mean{0, 0, 0};

  // Diffuse base, and the Schlick reflectance of what lies over it.
  Rgb diffuse{0, 0, 0};
  float coat_f0 = 0, coat_f90 = 0;

  // Transmissive dielectric: share of the surface, colour of what passes, index of the far side over this side.
  Passage passage = Passage::none;
  float glass = 0;
  Rgb tint{1, 1, 1};
  float eta = 1;
  // Its reflectance: glass_f0 + (glass_f90 - glass_f0) s, where s is the exact Fresnel reflectance rescaled from
  // [exact_f0, 1] to [0, 1]: plain glass has the exact equations themselves. exact_f0 = 1 stands for "no exact
  // equation" (ior 0) and takes s from Schlick.
  Rgb glass_f0{0, 0, 0};
  float glass_f90 = 1, exact_f0 = 0;

  Rgb reflection_tint{1, 1, 1};  // of what the glass reflects; what passes is not changed

  // Changes the reflection where there is one; and what gets through it to a diffuse base. Both live as long as the
  // lobes do.
  const ThinFilm* film = nullptr;
  const FilmedBase* filmed_base = nullptr;
};

// T(wo) and T(wi) / T_mean above, of cosines in [0, 1]: what of the light from a direction gets to the diffuse base,
// and what the base sends there, as a factor of Lambert's value.
Rgb base_entry(const LayeredLobes& lobes, float mu);
Rgb base_exit(const LayeredLobes& lobes, float mu);

// What of the scattering depends on wo alone: probabilities of choosing the diffuse base, rescattered light, the facets
// (reflected or transmitted) and the straight passage, from their approximate albedos; the base's share of light
// entering along wo; the factors of rescattered light but for (1 - E(wi)) / pi; 1 - E(wo), where anything is asked of
// E; and the projected area of the facets that wo sees.
struct LayeredView {
  V3f wo;
  float diffuse = 0, rescattered = 0, facets = 0, straight = 0;
  float visible_area = 1;
  float loss = 0;
  Rgb base_entry{1, 1, 1}, rescattering{0, 0, 0};
};

// And what depends on wi alone, wi.z > 0.
struct LayeredArrival {
  V3f wi;
  float cosine_pdf = 0, masking = 0;
  float loss = 0, loss_pdf = 0;  // 1 - E(wi), and the density that follows it
  Rgb base_exit{1, 1, 1};
};

// wo.z > 0 in all of these.
LayeredView view_along(const LayeredLobes& lobes, const V3f& wo);
LayeredArrival arrival_along(const LayeredLobes& lobes, const V3f& wi);
// evaluate_layered() of the two.
BsdfValue evaluate_reflected(const LayeredLobes& lobes, const LayeredView& view, const LayeredArrival& arrival);
BsdfValue evaluate_layered(const LayeredLobes& lobes, const LayeredView& view, const V3f& wi);
// That of (wi, view.wo), and with it that of (view.wo, wi); wi.z > 0.
BsdfValue evaluate_layered_back(const LayeredLobes& lobes, const LayeredView& view, const V3f& wi);
BsdfBothWays evaluate_layered_both_ways(const LayeredLobes& lobes, const LayeredView& view, const V3f& wi);
// What of their f_cos the diffuse base sends, and what is rescattered: each is a function of wo times one of wi.
Rgb matte_reflected(const LayeredLobes& lobes, const LayeredView& view, const LayeredArrival& arrival);
Rgb matte_layered(const LayeredLobes& lobes, const LayeredView& view, const V3f& wi);
BsdfSample sample_layered(const LayeredLobes& lobes, const LayeredView& view, float u_lobe, const V2f& u);
bool is_pure_delta(const LayeredLobes& lobes);
Rgb layered_albedo(const LayeredLobes& lobes, const V3f& wo);

}  // namespace helio
