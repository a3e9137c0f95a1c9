// Scattering at a surface point: a closed set of lobes chosen by the material's evaluated parameters.
//
// Directions are unit vectors in the local shading frame (z is the shading normal), pointing away from the surface.
// z > 0 is the outside (front face) for materials that bound a volume; opaque and thin materials are two-sided: wo is
// flipped to z > 0 by the caller's choice of frame, never in here.
#pragma once

#include <algorithm>

#include "renderer/base/math.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

// Microfacet alpha (roughness squared) below which a lobe is treated as a delta (mirror, smooth dielectric).
inline constexpr float kDeltaAlpha = 1e-3f;

// Which kinds of lobe a material has, after textures are evaluated.
enum class LobeModel : std::uint8_t {
  lambert,
  metallic_roughness,
  specular_glossiness,
  conductor,
  stack,
  plastic,
  pane,
  principled,
  blend,
  none
};

struct PlasticInterface;  // bsdf_plastic.h
struct BlendParams;       // bsdf_blend.h

// What may lie on or in a metallic-roughness base (LobeModel::stack); see bsdf_stack.h.
struct LayerParams {
  float clearcoat = 0;                      // [0, 1]
  float clearcoat_alpha = 0;                // [0, 1]
  V3f clearcoat_normal{0, 0, 1};            // unit, local frame
  Rgb sheen_color{0, 0, 0};                 // [0, 1]
  float sheen_alpha = 0;                    // [0, 1]
  float anisotropy = 0;                     // [0, 1]
  V2f anisotropy_direction{1, 0};           // unit, local frame: direction of the stretched highlight
  float iridescence = 0;                    // [0, 1]
  float film_ior = 1.3f;                    // >= 1
  float film_thickness = 0;                 // nm, >= 0
  float diffuse_transmission = 0;           // [0, 1], of the diffuse base
  Rgb diffuse_transmission_color{1, 1, 1};  // [0, 1]
};

// A material with its textures already looked up at the hit.
struct SurfaceParams {
  LobeModel model = LobeModel::lambert;
  MicrofacetDistribution distribution = MicrofacetDistribution::ggx;
  bool thin = true;                // no volume behind the surface: transmission does not bend
  float alpha = 1;                 // microfacet alpha = perceptual roughness squared, [0, 1]
  Rgb base_color{1, 1, 1};         // diffuse colour / metal f0 / transmission tint, [0, 1]
  float metallic = 0;              // [0, 1]
  float transmission = 0;          // [0, 1]
  float ior = 1.5f;                // inside over outside, >= 1 (0: specular-glossiness compatibility, f0 = f90 = 1)
  float specular = 1;              // KHR_materials_specular
  Rgb specular_color{1, 1, 1};     // also the tint of what conductor, plastic and pane reflect
  bool tinted_reflection = false;  // and of what the interface of metallic_roughness reflects, which keeps its f0
  Rgb f0{0.04f, 0.04f, 0.04f};     // specular_glossiness
  Rgb eta{1, 1, 1}, k{0, 0, 0};    // conductor
  // Anisotropic distributions: alpha along a unit direction of the local frame, and across; `alpha` is their geometric
  // mean.
  float alpha_along = 1, alpha_across = 1;
  V2f along{1, 0};
  // Scattering about another normal than the frame's (surface_map.h): that normal, unit, local frame; and alpha^2 of
  // its shadowing, 0: none. The directions above are in Frame(map_normal), `along` too.
  bool mapped = false;
  V3f map_normal{0, 0, 1};
  float map_alpha2 = 0;
  PrincipledMaterial principled;  // principled
  // Kept alive by whoever made these, and never null for the model that needs them.
  const LayerParams* layers = nullptr;        // stack
  const PlasticInterface* plastic = nullptr;  // plastic
  const BlendParams* blend = nullptr;         // blend
};

// Whether light may come out on the far side of the surface.
inline bool lets_light_through(const SurfaceParams& params) {
  return params.transmission > 0 || (params.model == LobeModel::stack && params.layers->diffuse_transmission > 0);
}

struct BsdfSample {
  V3f wi{0, 0, 0};
  Rgb weight{0, 0, 0};  // f |cos| / pdf for the chosen technique: the path's throughput factor
  float pdf_w = 0;      // solid angle density of the whole non-delta mixture at wi; probability of the lobe for deltas
  float eta = 1;        // 1, or the relative ior crossed (for throughput in roulette)
  bool delta = false;
  bool transmitted = false;  // went to the other side of the surface

  bool valid() const { return pdf_w > 0; }
};

struct BsdfValue {
  Rgb f_cos{0, 0, 0};  // f(wo, wi) |cos wi|, deltas excluded
  float pdf_w = 0;     // density with which sample_bsdf picks wi given that it may pick any lobe, deltas excluded
};

// The sample that a direction makes whose value and density are known; none where the density is 0 or not finite.
inline BsdfSample sample_of(const V3f& wi, const BsdfValue& value) {
  BsdfSample sample;
  if (!(value.pdf_w > 0) || !std::isfinite(value.pdf_w)) return sample;
  sample.wi = wi;
  sample.weight = value.f_cos / value.pdf_w;
  sample.pdf_w = value.pdf_w;
  return sample;
}

BsdfValue evaluate_bsdf(const SurfaceParams& params, const V3f& wo, const V3f& wi);

// The part of f_cos due to diffuse lobes, which varies little with the view direction. In all models but `principled`
// it is a sum of a few products g(wo) h(wi).
Rgb matte_cos(const SurfaceParams& params, const V3f& wo, const V3f& wi);

// The view-dependent share of the luminance of f_cos, [0, 1], given its diffuse part `matte`.
inline float varying_share(const Rgb& f_cos, const Rgb& matte) {
  const float all = luminance(f_cos);
  return all > 0 ? std::clamp(1 - luminance(matte) / all, 0.0f, 1.0f) : 1.0f;
}

// u_lobe and u in [0, 1). An invalid sample (pdf_w == 0) ends the path: the direction fell below the surface.
BsdfSample sample_bsdf(const SurfaceParams& params, const V3f& wo, float u_lobe, const V2f& u);

// True when every lobe is a delta: next-event estimation cannot contribute.
bool is_pure_delta(const SurfaceParams& params);

// Approximate hemispherical-directional reflectance + transmittance for the albedo feature, [0, 1].
Rgb surface_albedo(const SurfaceParams& params, const V3f& wo);

// The cheapest model with the same scattering: metallic-roughness without specular, metal and transmission is Lambert.
SurfaceParams simplify(const SurfaceParams& params);

}  // namespace helio
