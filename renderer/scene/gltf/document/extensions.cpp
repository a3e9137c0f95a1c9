#include "renderer/scene/gltf/document/extensions.h"

#include <set>

namespace helio::gltf {

namespace {

struct KnownExtension {
  std::string_view name;
  bool implemented;
  unsigned sites;
};

constexpr unsigned operator|(Site a, Site b) {
  return unsigned(a) | unsigned(b);
}

// Ratified extensions that are not implemented are listed for their place, which is checked all the same.
constexpr KnownExtension kKnown[] = {
    {"EXT_mesh_gpu_instancing", true, unsigned(Site::node)},
    {"EXT_meshopt_compression", true, Site::buffer | Site::buffer_view},
    {"EXT_texture_webp", false, unsigned(Site::texture)},
    {"KHR_animation_pointer", false, unsigned(Site::channel_target)},
    {"KHR_draco_mesh_compression", true, unsigned(Site::primitive)},
    {"KHR_lights_punctual", true, Site::root | Site::node},
    {"KHR_materials_anisotropy", true, unsigned(Site::material)},
    {"KHR_materials_clearcoat", true, unsigned(Site::material)},
    {"KHR_materials_diffuse_transmission", true, unsigned(Site::material)},
    {"KHR_materials_dispersion", false, unsigned(Site::material)},
    {"KHR_materials_emissive_strength", true, unsigned(Site::material)},
    {"KHR_materials_ior", true, unsigned(Site::material)},
    {"KHR_materials_iridescence", true, unsigned(Site::material)},
    {"KHR_materials_pbrSpecularGlossiness", true, unsigned(Site::material)},
    {"KHR_materials_sheen", true, unsigned(Site::material)},
    {"KHR_materials_specular", true, unsigned(Site::material)},
    {"KHR_materials_transmission", true, unsigned(Site::material)},
    {"KHR_materials_unlit", true, unsigned(Site::material)},
    {"KHR_materials_variants", true, Site::root | Site::primitive},
    {"KHR_materials_volume", true, unsigned(Site::material)},
    {"KHR_mesh_quantization", true, 0},
    {"KHR_node_visibility", false, unsigned(Site::node)},
    {"KHR_texture_basisu", false, unsigned(Site::texture)},
    {"KHR_texture_transform", true, unsigned(Site::texture_info)},
};

const KnownExtension* find_known(std::string_view name) {
  for (const KnownExtension& known : kKnown)
    if (known.name == name) return &known;
  return nullptr;
}

void check_unique(const JsonObject& root, const char* key, const std::vector<std::string>& list) {
  std::set<std::string_view> seen;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (!seen.insert(list[i]).second)
      root.diagnostics().tolerate(root.place() / key / i, "repeats \"" + list[i] + '"', "counted once");
  }
}

}  // namespace

ExtensionList ExtensionList::read(const JsonObject& root) {
  ExtensionList list;
  Diagnostics& diagnostics = root.diagnostics();
  const std::vector<std::string> used = root.strings("extensionsUsed");
  const std::vector<std::string> required = root.strings("extensionsRequired");
  list.used_.insert(used.begin(), used.end());
  list.required_.insert(required.begin(), required.end());
  for (std::size_t i = 0; i < required.size(); ++i) {
    const std::string& name = required[i];
    const KnownExtension* known = find_known(name);
    if (!known || !known->implemented)
      diagnostics.fail(root.place() / "extensionsRequired" / i,
                       "requires the extension " + name + ", which is not supported", ErrorCode::unimplemented);
    else if (!list.used(name))
      diagnostics.tolerate(root.place() / "extensionsRequired" / i,
                           "requires " + name + ", which extensionsUsed misses", "it is used");
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    const std::string& name = used[i];
    const KnownExtension* known = find_known(name);
    if ((!known || !known->implemented) && !list.required(name))
      diagnostics.warn("", "optional extension " + name + " is ignored");
    if (name == "KHR_mesh_quantization" && !list.required(name))
      diagnostics.tolerate(root.place() / "extensionsUsed" / i, name + " cannot be optional", "it is used");
  }
  list.used_.insert(required.begin(), required.end());
  check_unique(root, "extensionsUsed", used);
  check_unique(root, "extensionsRequired", required);
  return list;
}

bool ExtensionList::used(std::string_view name) const {
  return used_.contains(name);
}
bool ExtensionList::required(std::string_view name) const {
  return required_.contains(name);
}

void ExtensionList::check(const JsonObject& owner, Site site) const {
  if (!owner.has("extensions")) return;
  const JsonObject extensions = owner.object("extensions");
  for (const std::string& name : extensions.keys()) {
    const JsonObject extension = extensions.object(name.c_str());  // fails when it is not an object
    const KnownExtension* known = find_known(name);
    if (!used(name))
      owner.diagnostics().tolerate(extension.place(), "the extension is not declared in extensionsUsed",
                                   known && known->implemented ? "it is used" : "it is ignored");
    if (known && !(known->sites & unsigned(site)))
      owner.diagnostics().fail(extension.place(), "the extension may not stand here");
  }
}

}  // namespace helio::gltf
