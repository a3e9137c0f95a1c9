// The parameters of a material at a surface point: what its lobes are made of, with textures already looked up.
#pragma once

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

}  // namespace helio
