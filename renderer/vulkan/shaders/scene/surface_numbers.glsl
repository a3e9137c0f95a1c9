// Numbers of materials that textures give: trace/scene/surface_numbers.cpp.
#ifndef SURFACE_NUMBERS_GLSL
#define SURFACE_NUMBERS_GLSL

#include "bsdf/microfacet.glsl"

// What a texel multiplies a number by.
float number_factor(vec4 texel) {
  const float value = luminance(texel.rgb);
  return value > 0 ? min(value, 1.0) : 0.0;
}

// Sets the alphas of a material whose own distribution is kGgx or kBeckmann.
void set_alphas(uint distribution, float along, float across, inout LobeParams p) {
  p.distribution = distribution;
  if (p.model == kLobePrincipled) {
    const float aspect = sqrt(1 - 0.9 * p.principled.anisotropic);
    p.alpha = max(along, kDeltaAlpha);
    p.alpha_along = max(along / aspect, kDeltaAlpha);
    p.alpha_across = max(along * aspect, kDeltaAlpha);
  } else if (along != across) {
    p.alpha_along = along;
    p.alpha_across = across;
    if (max(along, across) >= kDeltaAlpha) {
      p.alpha_along = max(along, kDeltaAlpha);
      p.alpha_across = max(across, kDeltaAlpha);
    }
    p.alpha = sqrt(p.alpha_along * p.alpha_across);
  } else {
    p.alpha = along;
    return;
  }
  if (p.alpha_along == p.alpha_across || p.alpha < kDeltaAlpha) return;
  p.distribution = distribution == kBeckmann ? kBeckmannAnisotropic : kGgxAnisotropic;
}

// Sets the alphas of a material with number textures, after its other numbers. `along` and `across`: number_factor() of
// its roughness textures.
void apply_roughness_numbers(uint material, float along, float across, inout LobeParams p) {
  const uint distribution = material_of(material).distribution, present = material_of(material).present;
  const float roughness = material_of(material).roughness, roughness_across = material_of(material).roughness_across;
  if (p.model == kLobePrincipled) {
    set_alphas(distribution, sqr(roughness * along), 0, p);
    return;
  }
  if ((present & (1u << kNumberRoughness)) == 0) along = sqr(roughness);
  if ((present & (1u << kNumberRoughnessAcross)) == 0) across = roughness_across >= 0 ? sqr(roughness_across) : along;
  set_alphas(distribution, along, across, p);
}

#endif
