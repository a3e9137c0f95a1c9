#include "renderer/scene/load/scene_features.h"

#include <algorithm>
#include <limits>

#include "renderer/scene/description/material_slots.h"
#include "renderer/scene/description/scene_description.h"
#include "renderer/scene/images/texture.h"

namespace helio {
namespace {

// Microfacet alpha below which a lobe is a delta: kDeltaAlpha of trace/bsdf/bsdf.h.
constexpr float kDeltaAlpha = 1e-3f;
// Perceptual roughness up to which a lobe concentrates light enough for a caustic to be seen.
constexpr float kFocusRoughness = 0.5f;

// The range of perceptual roughness that a material may show; a texture multiplies by anything in [0, 1].
struct RoughnessRange {
  float low = 0, high = 1;
};

RoughnessRange roughness_range(const Material& m) {
  if (m.model == MaterialModel::specular_glossiness) {
    return {1 - m.glossiness, m.specular_glossiness_texture.present() ? 1.0f : 1 - m.glossiness};
  }
  const bool textured =
      m.metallic_roughness_texture.present() || m.numbers.roughness.present() || m.numbers.roughness_across.present();
  return {textured ? 0.0f : m.roughness, m.roughness};
}

bool is_lambert(const Material& m) {
  return m.model == MaterialModel::metallic_roughness && m.metallic == 0 && m.transmission == 0 && m.specular == 0 &&
         !m.layers.any();
}

bool absorbs(const Material& m) {
  return bounds_volume(m) && m.attenuation_distance < std::numeric_limits<float>::infinity() &&
         m.attenuation_color != Rgb(1, 1, 1);
}

bool emits(const Material& m) {
  return m.model != MaterialModel::unlit && !is_black(m.emission);
}

void add_material(const Material& m, SceneFeatures& f) {
  f.textures |= has_any_texture(m);
  f.normal_maps |= m.normal_texture.present() || m.bump_texture.present();
  if (emits(m)) {
    f.area_lights = true;
    f.textured_emission |= m.emission_texture.present();
  }
  f.only_lambert &= is_lambert(m);
  if (is_lambert(m) || m.model == MaterialModel::unlit) return;
  f.microfacet = true;
  const RoughnessRange roughness = roughness_range(m);
  f.delta_lobes |= roughness.low * roughness.low < kDeltaAlpha;
  f.rough_transmission |= m.transmission > 0 && roughness.high * roughness.high >= kDeltaAlpha;
  f.absorption |= absorbs(m);
  f.caustics |= roughness.low <= kFocusRoughness;
  if (m.model != MaterialModel::metallic_roughness || !m.layers.any()) return;
  f.layers = true;
  if (!(m.layers.clearcoat > 0)) return;
  const float coat_low = m.layers.clearcoat_roughness_texture.present() ? 0.0f : m.layers.clearcoat_roughness;
  f.normal_maps |= m.layers.clearcoat_normal_texture.present();
  f.delta_lobes |= coat_low * coat_low < kDeltaAlpha;
  f.caustics |= coat_low <= kFocusRoughness;
}

bool lets_light_pass(const Material& m, const TriangleMesh* mesh, const TextureTable& textures) {
  if (m.alpha_mode == AlphaMode::opaque) return false;
  if (m.base_alpha < 1 || (m.alpha_mode == AlphaMode::mask && m.alpha_cutoff > 1)) return true;
  if (const TextureSlot& slot = alpha_slot(m); slot.present() && textures.has_transparency(slot.image)) return true;
  return mesh && std::any_of(mesh->colors.begin(), mesh->colors.end(), [](const V4f& c) { return c.w < 1; });
}

}  // namespace

std::vector<MaterialUse> find_material_uses(const SceneDescription& scene) {
  std::vector<MaterialUse> uses(scene.materials.size());
  std::vector<std::uint64_t> placed(scene.objects.size(), 0);
  for (const Instance& instance : scene.instances) ++placed[std::size_t(instance.object)];
  const auto use = [&](const auto& self, int index) -> void {
    uses[std::size_t(index)].used = true;
    const Material& material = scene.materials[std::size_t(index)];
    if (material.model != MaterialModel::blend) return;
    self(self, material.blend.first);
    self(self, material.blend.second);
  };
  const auto add = [&](int material, std::uint64_t primitives) {
    use(use, material);
    uses[std::size_t(material)].primitives += primitives;
  };
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    if (placed[i] == 0) continue;
    for (const TriangleMesh& mesh : scene.objects[i].meshes) add(mesh.material, placed[i] * mesh.triangle_count());
    for (const Sphere& sphere : scene.objects[i].spheres) add(sphere.material, placed[i]);
  }
  return uses;
}

void update_features(const SceneDescription& scene, const std::vector<MaterialUse>& uses, SceneFeatures& features) {
  SceneFeatures f;
  f.only_lambert = true;
  f.instances = features.instances;
  f.spheres = features.spheres;
  f.smooth_normals = features.smooth_normals;
  f.vertex_colors = features.vertex_colors;
  f.alpha = features.alpha;
  f.fast_rays = features.fast_rays;
  std::uint64_t lights = 0;
  for (std::size_t i = 0; i < uses.size(); ++i) {
    if (!uses[i].used) continue;
    add_material(scene.materials[i], f);
    if (emits(scene.materials[i])) lights += uses[i].primitives;
  }
  f.environment = scene.environment && !is_black(scene.environment->radiance);
  f.delta_lights = !scene.lights.empty();
  lights += scene.lights.size();
  lights += f.environment ? 1 : 0;
  f.light_tree = lights >= kLightTreeThreshold;
  f.light_count = std::uint32_t(std::min<std::uint64_t>(lights, std::numeric_limits<std::uint32_t>::max()));
  features = f;
}

SceneFeatures find_scene_features(const SceneDescription& scene) {
  SceneFeatures f;
  const TextureTable textures(scene.images);
  std::vector<std::uint32_t> placed(scene.objects.size(), 0);
  for (const Instance& instance : scene.instances) ++placed[std::size_t(instance.object)];
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    if (placed[i] == 0) continue;
    const Object& object = scene.objects[i];
    f.instances |= placed[i] > 1;
    f.spheres |= !object.spheres.empty();
    for (const TriangleMesh& mesh : object.meshes) {
      f.smooth_normals |= !mesh.normals.empty();
      f.vertex_colors |= !mesh.colors.empty();
      f.alpha |= lets_light_pass(scene.materials[std::size_t(mesh.material)], &mesh, textures);
    }
    for (const Sphere& sphere : object.spheres) {
      f.alpha |= lets_light_pass(scene.materials[std::size_t(sphere.material)], nullptr, textures);
    }
  }
  update_features(scene, find_material_uses(scene), f);
  return f;
}

std::vector<std::string> SceneFeatures::names() const {
  const std::pair<bool, const char*> bits[] = {
      {only_lambert, "only_lambert"},
      {delta_lobes, "delta_lobes"},
      {rough_transmission, "rough_transmission"},
      {microfacet, "microfacet"},
      {absorption, "absorption"},
      {layers, "layers"},
      {textures, "textures"},
      {normal_maps, "normal_maps"},
      {vertex_colors, "vertex_colors"},
      {alpha, "alpha"},
      {instances, "instances"},
      {spheres, "spheres"},
      {smooth_normals, "smooth_normals"},
      {fast_rays, "fast_rays"},
      {area_lights, "area_lights"},
      {textured_emission, "textured_emission"},
      {delta_lights, "delta_lights"},
      {environment, "environment"},
      {light_tree, "light_tree"},
      {caustics, "caustics"},
  };
  std::vector<std::string> names;
  for (const auto& [set, name] : bits) {
    if (set) names.emplace_back(name);
  }
  return names;
}

}  // namespace helio
