// Material -> MaterialRecord: everything about a material that does not depend on where it is hit.
#include <algorithm>

#include "renderer/scene/description/material_slots.h"
#include "renderer/trace/bsdf/bsdf.h"
#include "renderer/trace/scene/scene_data.h"
#include "renderer/trace/scene/surface_layers.h"
#include "renderer/trace/scene/surface_numbers.h"

namespace helio {
namespace {

// Absorption coefficient whose transmittance over attenuation_distance is attenuation_color (KHR_materials_volume).
Rgb absorption_coefficient(const Material& m) {
  Rgb sigma(0, 0, 0);
  if (!(m.attenuation_distance > 0) || !std::isfinite(m.attenuation_distance)) return sigma;
  for (int c = 0; c < 3; ++c) {
    // A channel that is absorbed completely would make the coefficient infinite: 1e-6 is invisible and finite.
    sigma[c] = -std::log(std::clamp(m.attenuation_color[c], 1e-6f, 1.0f)) / m.attenuation_distance;
  }
  return sigma;
}

LobeModel lobe_model(const Material& m) {
  switch (m.model) {
    case MaterialModel::unlit:
      return LobeModel::none;
    case MaterialModel::conductor:
      return LobeModel::conductor;
    case MaterialModel::specular_glossiness:
      return LobeModel::specular_glossiness;
    case MaterialModel::plastic:
      return LobeModel::plastic;
    case MaterialModel::pane:
      return LobeModel::pane;
    case MaterialModel::principled:
      return LobeModel::principled;
    case MaterialModel::blend:
      return LobeModel::blend;
    case MaterialModel::metallic_roughness:
      break;
  }
  if (m.layers.any()) return LobeModel::stack;
  const bool lambert = m.metallic == 0 && m.transmission == 0 && m.specular == 0;
  return lambert ? LobeModel::lambert : LobeModel::metallic_roughness;
}

LayerParams layer_params(const MaterialLayers& m) {
  LayerParams p;
  p.clearcoat = m.clearcoat;
  p.clearcoat_alpha = sqr(m.clearcoat_roughness);
  p.sheen_color = m.sheen_color;
  p.sheen_alpha = sqr(m.sheen_roughness);
  p.anisotropy = m.anisotropy;
  p.anisotropy_direction = V2f(std::cos(m.anisotropy_rotation), std::sin(m.anisotropy_rotation));
  p.iridescence = m.iridescence;
  p.film_ior = m.iridescence_ior;
  p.film_thickness = std::min(m.iridescence_thickness_max, kThickestFilm);
  p.diffuse_transmission = m.diffuse_transmission;
  p.diffuse_transmission_color = m.diffuse_transmission_color;
  return p;
}

bool has_layer_texture(const MaterialLayers& m) {
  return m.clearcoat_texture.present() || m.clearcoat_roughness_texture.present() || m.sheen_color_texture.present() ||
         m.sheen_roughness_texture.present() || m.anisotropy_texture.present() || m.iridescence_texture.present() ||
         m.iridescence_thickness_texture.present() || m.diffuse_transmission_texture.present() ||
         m.diffuse_transmission_color_texture.present();
}

}  // namespace

MaterialRecord make_material_record(const Material& m) {
  MaterialRecord r;
  SurfaceParams& p = r.params;
  p.model = lobe_model(m);
  p.distribution = m.distribution;
  p.thin = !bounds_volume(m);
  const float roughness = m.model == MaterialModel::specular_glossiness ? 1 - m.glossiness : m.roughness;
  p.alpha = sqr(roughness);
  p.base_color = m.base_color;
  p.metallic = m.metallic;
  p.transmission = m.transmission;
  p.ior = m.ior;
  p.specular = m.specular;
  p.specular_color = m.specular_color;
  p.f0 = m.specular_glossiness_f0;
  p.eta = m.conductor_eta;
  p.k = m.conductor_k;
  p.tinted_reflection = m.tinted_reflection;
  p.principled = m.principled;
  set_alphas(m, p.alpha, m.roughness_across >= 0 ? sqr(m.roughness_across) : p.alpha, p);

  r.unlit = m.model == MaterialModel::unlit;
  r.emission = r.unlit ? m.base_color : m.emission;
  r.emissive = !is_black(r.emission);
  r.double_sided = m.double_sided;
  r.one_sided = m.one_sided;
  r.volume = !p.thin;
  r.absorption = r.volume ? absorption_coefficient(m) : Rgb(0, 0, 0);
  const bool mapped = m.normal_texture.present() || m.bump_texture.present();
  r.normal_mapped = mapped && m.map_rule == MapRule::bend;
  r.scatters_mapped = mapped && m.map_rule != MapRule::bend;
  r.specular = p.model != LobeModel::none && p.model != LobeModel::lambert;
  const bool needs_lookup = m.base_color_texture.present() || m.metallic_roughness_texture.present() ||
                            m.specular_texture.present() || m.specular_color_texture.present() ||
                            m.transmission_texture.present() || m.specular_glossiness_texture.present();
  r.numbers_textured = has_number_texture(m);
  r.textured = needs_lookup || r.numbers_textured;
  r.plain_lambert = p.model == LobeModel::lambert && !r.scatters_mapped;
  if (p.model == LobeModel::stack) {
    r.layers = layer_params(m.layers);
    r.layers_textured = has_layer_texture(m.layers);
    p.layers = &r.layers;
  }
  if (p.model == LobeModel::plastic) {
    r.plastic = make_plastic_interface(p.distribution, p.alpha, p.ior, m.nonlinear);
    p.plastic = r.plastic.get();
  }
  r.pure_delta = p.model != LobeModel::blend && is_pure_delta(p);
  p.layers = nullptr;  // records move
  return r;
}

bool has_alpha(const Material& material, const TriangleMesh* mesh, const TextureTable& textures) {
  if (material.alpha_mode == AlphaMode::opaque) return false;
  if (material.base_alpha < 1) return true;
  // glTF 2.0, 3.9.4: a cutoff above 1 makes the whole material transparent.
  if (material.alpha_mode == AlphaMode::mask && material.alpha_cutoff > 1) return true;
  if (const TextureSlot& slot = alpha_slot(material); slot.present() && textures.has_transparency(slot.image))
    return true;
  return mesh && std::any_of(mesh->colors.begin(), mesh->colors.end(), [](const V4f& c) { return c.w < 1; });
}

}  // namespace helio
