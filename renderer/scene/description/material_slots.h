// The texture slots of a material, visited one by one, for whoever needs "every texture of".
#pragma once

#include <vector>

#include "renderer/scene/description/scene_description.h"

namespace helio {

// As below, of the textures that give numbers.
template <class NumbersRef, class Visit>
void for_each_number_slot(NumbersRef& numbers, Visit&& visit) {
  visit(numbers.roughness);
  visit(numbers.roughness_across);
  visit(numbers.metallic);
  visit(numbers.transmission);
  visit(numbers.anisotropic);
  visit(numbers.spec_tint);
  visit(numbers.sheen);
  visit(numbers.sheen_tint);
  visit(numbers.flatness);
  visit(numbers.clearcoat);
  visit(numbers.clearcoat_gloss);
}

// Calls visit(slot) for each slot, present or not; works for Material& and const Material&.
template <class MaterialRef, class Visit>
void for_each_texture_slot(MaterialRef& material, Visit&& visit) {
  visit(material.base_color_texture);
  visit(material.metallic_roughness_texture);
  visit(material.specular_glossiness_texture);
  visit(material.specular_texture);
  visit(material.specular_color_texture);
  visit(material.transmission_texture);
  visit(material.thickness_texture);
  visit(material.emission_texture);
  visit(material.normal_texture);
  visit(material.bump_texture);
  visit(material.opacity_texture);
  auto& layers = material.layers;
  visit(layers.clearcoat_texture);
  visit(layers.clearcoat_roughness_texture);
  visit(layers.clearcoat_normal_texture);
  visit(layers.sheen_color_texture);
  visit(layers.sheen_roughness_texture);
  visit(layers.anisotropy_texture);
  visit(layers.iridescence_texture);
  visit(layers.iridescence_thickness_texture);
  visit(layers.diffuse_transmission_texture);
  visit(layers.diffuse_transmission_color_texture);
  visit(material.blend.weight_texture);
  for_each_number_slot(material.numbers, visit);
}

inline bool has_any_texture(const Material& material) {
  bool any = false;
  for_each_texture_slot(material, [&](const TextureSlot& slot) { any |= slot.present(); });
  return any;
}

inline bool has_number_texture(const Material& material) {
  bool any = false;
  for_each_number_slot(material.numbers, [&](const TextureSlot& slot) { any |= slot.present(); });
  return any;
}

// The texture whose alpha channel says where the material is; it may be absent.
inline const TextureSlot& alpha_slot(const Material& material) {
  return material.opacity_texture.present() ? material.opacity_texture : material.base_color_texture;
}

// Whether it matters how a sphere of this material is turned.
inline bool has_orientation(const Material& material) {
  return has_any_texture(material) || material.roughness_across >= 0 || material.layers.anisotropy > 0 ||
         material.principled.anisotropic > 0 || material.model == MaterialModel::blend;
}

// Every slot in use, once.
inline std::vector<TextureSlot> used_texture_slots(const SceneDescription& scene) {
  std::vector<TextureSlot> slots;
  for (const Material& material : scene.materials) {
    for_each_texture_slot(material, [&](const TextureSlot& slot) {
      if (slot.present()) slots.push_back(slot);
    });
  }
  return slots;
}

}  // namespace helio
