// The materials that only Mitsuba scenes have, one per lobe and way of mixing them.
#pragma once

#include <deque>
#include <memory>

#include "renderer/trace/bsdf/bsdf_blend.h"
#include "renderer/trace/bsdf/bsdf_microfacet.h"
#include "renderer/trace/bsdf/bsdf_plastic.h"
#include "tests/unit/trace/bsdf/bsdf_cases.h"

namespace helio::test {

inline SurfaceParams brushed(SurfaceParams params, float along, float across) {
  using enum MicrofacetDistribution;
  params.distribution = params.distribution == ggx ? ggx_anisotropic : beckmann_anisotropic;
  params.alpha_along = along;
  params.alpha_across = across;
  params.alpha = std::sqrt(along * across);
  params.along = V2f(0.6f, 0.8f);
  return params;
}

inline SurfaceParams mitsuba_conductor(MicrofacetDistribution distribution, float alpha) {
  SurfaceParams params = metallic_roughness(distribution, alpha);
  params.model = LobeModel::conductor;
  params.eta = {1.657f, 0.88f, 0.521f};
  params.k = {9.224f, 6.27f, 4.837f};
  return params;
}

// Interfaces are kept for the rest of the program.
inline SurfaceParams plastic(MicrofacetDistribution distribution, float alpha, float ior, const Rgb& base,
                             bool nonlinear = false) {
  static std::deque<std::shared_ptr<const PlasticInterface>> interfaces;
  SurfaceParams params = metallic_roughness(distribution, alpha);
  params.model = LobeModel::plastic;
  params.base_color = base;
  params.ior = ior;
  params.plastic = interfaces.emplace_back(make_plastic_interface(distribution, alpha, ior, nonlinear)).get();
  return params;
}

inline SurfaceParams pane(float ior) {
  SurfaceParams params;
  params.model = LobeModel::pane;
  params.alpha = 0;
  params.ior = ior;
  params.transmission = 1;
  return params;
}

inline SurfaceParams principled(float alpha, float ior, const Rgb& base, const PrincipledMaterial& own) {
  SurfaceParams params = metallic_roughness(MicrofacetDistribution::ggx, alpha);
  params.model = LobeModel::principled;
  params.base_color = base;
  params.ior = ior;
  params.principled = own;
  return params;
}

inline SurfaceParams blend(const SurfaceParams& first, const SurfaceParams& second, float weight) {
  static std::deque<BlendParams> kept;
  SurfaceParams params;
  params.model = LobeModel::blend;
  params.thin = first.thin && second.thin;
  params.transmission = std::max(first.transmission, second.transmission);
  params.blend = &kept.emplace_back(BlendParams{first, second, weight});
  return params;
}

// `white`: nothing absorbs.
inline std::vector<NamedMaterial> mitsuba_materials(float alpha, bool white) {
  using enum MicrofacetDistribution;
  std::vector<NamedMaterial> list;
  const Rgb base = white ? Rgb(1, 1, 1) : Rgb(0.7f, 0.3f, 0.1f);
  const auto metal = [&](MicrofacetDistribution distribution) {
    SurfaceParams params = mitsuba_conductor(distribution, alpha);
    if (white) params.eta = Rgb(0), params.k = Rgb(1);  // reflects all
    return params;
  };
  list.push_back({"brushed ggx conductor", brushed(metal(ggx), alpha, 0.3f * alpha + 0.05f)});
  list.push_back({"brushed beckmann conductor", brushed(metal(beckmann), 0.3f * alpha + 0.05f, alpha)});
  SurfaceParams clear = glass(beckmann, alpha, 1.5f, false);
  clear.base_color = white ? Rgb(1, 1, 1) : Rgb(0.9f, 0.8f, 0.7f);
  const SurfaceParams brushed_clear = brushed(clear, alpha, 0.3f * alpha + 0.05f);
  list.push_back({"brushed glass", brushed_clear});
  list.push_back({"brushed glass from inside", brushed_clear, true});
  if (!white) {
    SurfaceParams stained = glass(ggx, alpha, 1.5f, false);
    stained.tinted_reflection = true;
    stained.specular_color = {0.3f, 0.6f, 0.9f};
    list.push_back({"glass of tinted reflection", stained});
    list.push_back({"glass of tinted reflection from inside", stained, true});
  }
  list.push_back({"smooth plastic", plastic(ggx, 0, 1.5f, base)});
  list.push_back({"rough ggx plastic", plastic(ggx, alpha, 1.49f, base)});
  SurfaceParams tinted = plastic(beckmann, alpha, 1.9f, base, true);
  if (!white) tinted.specular_color = {0.9f, 0.5f, 0.4f};
  list.push_back({"rough beckmann plastic nonlinear", tinted});
  PrincipledMaterial own;
  SurfaceParams dielectric = principled(alpha, 1.5f, base, own);
  list.push_back({"principled dielectric", dielectric});
  own.clearcoat = 0.8f;
  own.clearcoat_gloss = 0.3f;
  own.sheen = 0.7f;
  own.sheen_tint = 0.5f;
  own.flatness = 0.6f;
  own.spec_tint = 0.4f;
  own.anisotropic = 0.8f;
  SurfaceParams everything = brushed(principled(alpha, 1.4f, base, own), 2 * alpha, 0.5f * alpha);
  everything.metallic = 0.3f;
  list.push_back({"principled everything", everything});
  everything.transmission = 0.6f;
  everything.thin = false;
  list.push_back({"principled volume", everything});
  list.push_back({"principled volume from inside", everything, true});
  SurfaceParams diffuse;
  diffuse.base_color = base;
  list.push_back({"diffuse and metal", blend(diffuse, metal(ggx), 0.35f)});
  list.push_back({"plastic and mirror", blend(plastic(ggx, alpha, 1.5f, base), mitsuba_conductor(ggx, 0), 0.4f)});
  const SurfaceParams in_glass = blend(clear, diffuse, 0.3f);
  list.push_back({"glass and diffuse", in_glass});
  list.push_back({"glass and diffuse from inside", in_glass, true});
  list.push_back({"blend in blend", blend(blend(diffuse, metal(beckmann), 0.5f), tinted, 0.25f)});
  return list;
}

}  // namespace helio::test
