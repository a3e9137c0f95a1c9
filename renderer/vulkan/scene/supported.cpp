#include "renderer/vulkan/scene/supported.h"

#include "renderer/trace/scene/scene_data.h"
#include "renderer/vulkan/scene/material_tables.h"

namespace helio::vulkan {
namespace {

std::string layers_of(const MaterialLayers& layers) {
  std::string names;
  const auto add = [&](bool there, const char* name) {
    if (there) names += (names.empty() ? "" : ", ") + std::string(name);
  };
  add(layers.clearcoat > 0, "clearcoat");
  add(!is_black(layers.sheen_color), "sheen");
  add(layers.anisotropy > 0, "anisotropy");
  add(layers.iridescence > 0, "iridescence");
  add(layers.diffuse_transmission > 0, "diffuse transmission");
  return names;
}

std::string reason_of(const std::vector<Material>& materials, const Material& material, const MaterialRecord& record) {
  if (record.params.model == LobeModel::stack) return layers_of(material.layers);
  if (material.model != MaterialModel::blend) return {};
  for (const int part : {material.blend.first, material.blend.second}) {
    if (materials[std::size_t(part)].model == MaterialModel::blend) return "a blend within a blend";
  }
  return {};
}

}  // namespace

std::vector<std::string> unsupported(const RenderScene& scene) {
  const SceneData& data = scene.impl();
  const std::vector<Material>& materials = data.description.materials;
  const std::vector<bool> used = used_materials(data);
  std::vector<std::string> list;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    if (!used[i]) continue;
    const std::string reason = reason_of(materials, materials[i], data.materials[i]);
    if (reason.empty()) continue;
    const std::string& name = materials[i].name;
    list.push_back("material " + (name.empty() ? std::to_string(i) : "'" + name + "'") + ": " + reason);
  }
  if (data.mip_mapped) list.push_back("mip-mapped textures");
  return list;
}

}  // namespace helio::vulkan
