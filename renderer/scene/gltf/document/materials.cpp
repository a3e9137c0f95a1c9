// materials, with the KHR_materials_ extensions that we implement and extras.heliograph.
#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "renderer/scene/gltf/document/extras.h"
#include "renderer/scene/gltf/document/material_layers.h"
#include "renderer/scene/gltf/document/textures.h"

namespace helio::gltf {

namespace {

class MaterialReader {
 public:
  MaterialReader(const JsonObject& object, const Document& document) : object_(object), document_(document) {}

  Material read() {
    object_.only({"pbrMetallicRoughness", "normalTexture", "occlusionTexture", "emissiveTexture", "emissiveFactor",
                  "alphaMode", "alphaCutoff", "doubleSided"});
    document_.extensions.check(object_, Site::material);
    material_.name = object_.string("name");
    read_metallic_roughness(object_.object("pbrMetallicRoughness"));
    read_surface();
    read_emission();
    read_dielectric();
    read_volume(extension("KHR_materials_volume"));
    read_material_layers(object_, document_, material_.layers);
    read_specular_glossiness(extension("KHR_materials_pbrSpecularGlossiness"));
    // Simplest first: unlit wins where a file gives several models (KHR_materials_unlit, "fallback").
    if (extension("KHR_materials_unlit").exists()) material_.model = MaterialModel::unlit;
    read_material_extras(object_, material_);
    return std::move(material_);
  }

 private:
  JsonObject extension(const char* name) const { return object_.extension(name); }
  TextureSlot slot(const JsonObject& owner, const char* key, TexelEncoding encoding = TexelEncoding::linear) const {
    return read_texture_slot(owner, key, encoding, document_);
  }
  void read_color(const JsonObject& owner, const char* key) {
    const std::vector<double> color = owner.numbers(key, 3, 4, kUnit);
    if (color.size() == 3) owner.diagnostics().tolerate(owner.place() / key, "has 3 elements, allowed: 4", "alpha is 1");
    material_.base_color = color.empty() ? Rgb(1) : Rgb(float(color[0]), float(color[1]), float(color[2]));
    material_.base_alpha = color.size() < 4 ? 1.0f : float(color[3]);
  }

  void read_metallic_roughness(const JsonObject& pbr) {
    pbr.only({"baseColorFactor", "baseColorTexture", "metallicFactor", "roughnessFactor", "metallicRoughnessTexture"});
    document_.extensions.check(pbr, Site::elsewhere);
    read_color(pbr, "baseColorFactor");
    material_.base_color_texture = slot(pbr, "baseColorTexture", TexelEncoding::srgb);
    material_.metallic = float(pbr.number("metallicFactor", 1, kUnit));
    material_.roughness = float(pbr.number("roughnessFactor", 1, kUnit));
    material_.metallic_roughness_texture = slot(pbr, "metallicRoughnessTexture");
  }

  void read_surface() {
    material_.normal_texture = slot(object_, "normalTexture");
    material_.normal_scale = float(object_.object("normalTexture").number("scale", 1));
    // Occlusion is what a path tracer computes; its reference is still checked.
    const TextureSlot occlusion = slot(object_, "occlusionTexture");
    (void)occlusion;
    object_.object("occlusionTexture").number("strength", 1, kUnit);
    material_.double_sided = object_.boolean("doubleSided", false);
    material_.alpha_cutoff = float(object_.number("alphaCutoff", 0.5, kNonNegative));
    const std::string mode = object_.string("alphaMode", "OPAQUE");
    if (mode == "MASK")
      material_.alpha_mode = AlphaMode::mask;
    else if (mode == "BLEND")
      material_.alpha_mode = AlphaMode::blend;
    else if (mode != "OPAQUE")
      object_.diagnostics().fail(object_.place() / "alphaMode", "is \"" + mode + "\", allowed: OPAQUE, MASK, BLEND");
  }

  void read_emission() {
    const JsonObject strength = extension("KHR_materials_emissive_strength");
    strength.only({"emissiveStrength"});
    const Rgb factor = object_.rgb("emissiveFactor", Rgb(0), kNonNegative);
    if (std::max({factor.x, factor.y, factor.z}) > 1)
      object_.diagnostics().tolerate(object_.place() / "emissiveFactor",
                                     fmt::format("is [{:.9g}, {:.9g}, {:.9g}], allowed: 0 to 1 each, times the strength "
                                                 "of KHR_materials_emissive_strength",
                                                 factor.x, factor.y, factor.z),
                                     "read as it is");
    material_.emission = factor * float(strength.number("emissiveStrength", 1, kNonNegative));
    material_.emission_texture = slot(object_, "emissiveTexture", TexelEncoding::srgb);
  }

  void read_dielectric() {
    const JsonObject specular = extension("KHR_materials_specular");
    specular.only({"specularFactor", "specularTexture", "specularColorFactor", "specularColorTexture"});
    material_.specular = float(specular.number("specularFactor", 1, kUnit));
    material_.specular_color = specular.rgb("specularColorFactor", Rgb(1), kNonNegative);
    material_.specular_texture = slot(specular, "specularTexture");
    material_.specular_color_texture = slot(specular, "specularColorTexture", TexelEncoding::srgb);

    const JsonObject ior = extension("KHR_materials_ior");
    ior.only({"ior"});
    const double value = ior.number("ior", 1.5, kNonNegative);
    material_.ior = float(value == 0 ? value : at_least_one(ior, "ior", value, "0, or at least 1"));

    const JsonObject transmission = extension("KHR_materials_transmission");
    transmission.only({"transmissionFactor", "transmissionTexture"});
    material_.transmission = float(transmission.number("transmissionFactor", 0, kUnit));
    material_.transmission_texture = slot(transmission, "transmissionTexture");
  }

  void read_volume(const JsonObject& volume) {
    volume.only({"thicknessFactor", "thicknessTexture", "attenuationDistance", "attenuationColor"});
    material_.thickness = float(volume.number("thicknessFactor", 0, kNonNegative));
    material_.thickness_texture = slot(volume, "thicknessTexture");
    material_.attenuation_distance =
        float(volume.number("attenuationDistance", std::numeric_limits<double>::infinity(), kPositive));
    material_.attenuation_color = volume.rgb("attenuationColor", Rgb(1), kUnit);
  }

  void read_specular_glossiness(const JsonObject& sg) {
    if (!sg.exists()) return;
    sg.only({"diffuseFactor", "diffuseTexture", "specularFactor", "glossinessFactor", "specularGlossinessTexture"});
    material_.model = MaterialModel::specular_glossiness;
    read_color(sg, "diffuseFactor");
    material_.base_color_texture = slot(sg, "diffuseTexture", TexelEncoding::srgb);
    material_.specular_glossiness_f0 = sg.rgb("specularFactor", Rgb(1), kUnit);
    material_.glossiness = float(sg.number("glossinessFactor", 1, kUnit));
    material_.specular_glossiness_texture = slot(sg, "specularGlossinessTexture", TexelEncoding::srgb);
    // The metallic-roughness model beside it is the file's fallback for others; its texture would only cost memory.
    material_.metallic_roughness_texture = TextureSlot{};
  }

  JsonObject object_;
  const Document& document_;
  Material material_;
};

}  // namespace

void read_materials(const JsonObject& root, Document& document) {
  root.each("materials", [&](const JsonObject& object, std::size_t) {
    document.materials.push_back(MaterialReader(object, document).read());
    // A clearcoat's normal map asks for a tangent space, given or derived from normals.
    document.needs_tangents.push_back(object.extension("KHR_materials_clearcoat").has("clearcoatNormalTexture") &&
                                      !object.has("normalTexture"));
  });
}

}  // namespace helio::gltf
