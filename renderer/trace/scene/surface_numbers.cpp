#include "renderer/trace/scene/surface_numbers.h"

namespace helio {

void set_alphas(const Material& m, float along, float across, SurfaceParams& p) {
  p.distribution = m.distribution;
  if (m.model == MaterialModel::principled) {
    const float aspect = std::sqrt(1 - 0.9f * p.principled.anisotropic);
    p.alpha = std::max(along, kDeltaAlpha);
    p.alpha_along = std::max(along / aspect, kDeltaAlpha);
    p.alpha_across = std::max(along * aspect, kDeltaAlpha);
  } else if (along != across) {
    p.alpha_along = along;
    p.alpha_across = across;
    if (std::max(along, across) >= kDeltaAlpha) {
      p.alpha_along = std::max(along, kDeltaAlpha);
      p.alpha_across = std::max(across, kDeltaAlpha);
    }
    p.alpha = std::sqrt(p.alpha_along * p.alpha_across);
  } else {
    p.alpha = along;
    return;
  }
  if (p.alpha_along == p.alpha_across || p.alpha < kDeltaAlpha) return;
  p.distribution = m.distribution == MicrofacetDistribution::beckmann ? MicrofacetDistribution::beckmann_anisotropic
                                                                      : MicrofacetDistribution::ggx_anisotropic;
}

void apply_number_textures(const SceneData& scene, const Hit& hit, float footprint, const Surface& s,
                           SurfaceParams& p) {
  const Material& m = scene.description.materials[s.part->material];
  const NumberTextures& textures = m.numbers;
  const auto scaled = [&](const TextureSlot& slot, float number) {
    if (!slot.present()) return number;
    const V4f t = surface_texel(scene, hit, s, slot, footprint);
    const float value = luminance(Rgb(t.x, t.y, t.z));
    return number * (value > 0 ? std::min(value, 1.0f) : 0.0f);
  };
  p.metallic = scaled(textures.metallic, m.metallic);
  p.transmission = scaled(textures.transmission, m.transmission);
  p.principled.anisotropic = scaled(textures.anisotropic, m.principled.anisotropic);
  p.principled.spec_tint = scaled(textures.spec_tint, m.principled.spec_tint);
  p.principled.sheen = scaled(textures.sheen, m.principled.sheen);
  p.principled.sheen_tint = scaled(textures.sheen_tint, m.principled.sheen_tint);
  p.principled.flatness = scaled(textures.flatness, m.principled.flatness);
  p.principled.clearcoat = scaled(textures.clearcoat, m.principled.clearcoat);
  p.principled.clearcoat_gloss = scaled(textures.clearcoat_gloss, m.principled.clearcoat_gloss);
  if (m.model == MaterialModel::principled) return set_alphas(m, sqr(scaled(textures.roughness, m.roughness)), 0, p);
  const float along = textures.roughness.present() ? scaled(textures.roughness, 1) : sqr(m.roughness);
  float across = along;
  if (textures.roughness_across.present())
    across = scaled(textures.roughness_across, 1);
  else if (m.roughness_across >= 0)
    across = sqr(m.roughness_across);
  set_alphas(m, along, across, p);
}

}  // namespace helio
