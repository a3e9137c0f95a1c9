#include "renderer/scene/gltf/document/material_layers.h"

#include <cmath>
#include <numbers>

#include "renderer/scene/gltf/document/textures.h"

namespace helio::gltf {

namespace {

void read_clearcoat(const JsonObject& coat, const Document& document, MaterialLayers& layers) {
  coat.only({"clearcoatFactor", "clearcoatTexture", "clearcoatRoughnessFactor", "clearcoatRoughnessTexture",
             "clearcoatNormalTexture"});
  layers.clearcoat = float(coat.number("clearcoatFactor", 0, kUnit));
  layers.clearcoat_roughness = float(coat.number("clearcoatRoughnessFactor", 0, kUnit));
  layers.clearcoat_texture = read_texture_slot(coat, "clearcoatTexture", TexelEncoding::linear, document);
  layers.clearcoat_roughness_texture =
      read_texture_slot(coat, "clearcoatRoughnessTexture", TexelEncoding::linear, document);
  layers.clearcoat_normal_texture = read_texture_slot(coat, "clearcoatNormalTexture", TexelEncoding::linear, document);
  layers.clearcoat_normal_scale = float(coat.object("clearcoatNormalTexture").number("scale", 1));
}

void read_sheen(const JsonObject& sheen, const Document& document, MaterialLayers& layers) {
  sheen.only({"sheenColorFactor", "sheenColorTexture", "sheenRoughnessFactor", "sheenRoughnessTexture"});
  layers.sheen_color = sheen.rgb("sheenColorFactor", Rgb(0), kUnit);
  layers.sheen_roughness = float(sheen.number("sheenRoughnessFactor", 0, kUnit));
  layers.sheen_color_texture = read_texture_slot(sheen, "sheenColorTexture", TexelEncoding::srgb, document);
  layers.sheen_roughness_texture = read_texture_slot(sheen, "sheenRoughnessTexture", TexelEncoding::linear, document);
}

void read_anisotropy(const JsonObject& anisotropy, const Document& document, MaterialLayers& layers) {
  anisotropy.only({"anisotropyStrength", "anisotropyRotation", "anisotropyTexture"});
  layers.anisotropy = float(anisotropy.number("anisotropyStrength", 0, kUnit));
  layers.anisotropy_rotation = float(std::remainder(anisotropy.number("anisotropyRotation", 0), 2 * std::numbers::pi));
  layers.anisotropy_texture = read_texture_slot(anisotropy, "anisotropyTexture", TexelEncoding::linear, document);
}

void read_iridescence(const JsonObject& film, const Document& document, MaterialLayers& layers) {
  film.only({"iridescenceFactor", "iridescenceTexture", "iridescenceIor", "iridescenceThicknessMinimum",
             "iridescenceThicknessMaximum", "iridescenceThicknessTexture"});
  layers.iridescence = float(film.number("iridescenceFactor", 0, kUnit));
  const double ior = film.number("iridescenceIor", 1.3, kNonNegative);
  layers.iridescence_ior = float(at_least_one(film, "iridescenceIor", ior, "at least 1"));
  layers.iridescence_thickness_min = float(film.number("iridescenceThicknessMinimum", 100, kNonNegative));
  layers.iridescence_thickness_max = float(film.number("iridescenceThicknessMaximum", 400, kNonNegative));
  layers.iridescence_texture = read_texture_slot(film, "iridescenceTexture", TexelEncoding::linear, document);
  layers.iridescence_thickness_texture =
      read_texture_slot(film, "iridescenceThicknessTexture", TexelEncoding::linear, document);
}

void read_diffuse_transmission(const JsonObject& diffuse, const Document& document, MaterialLayers& layers) {
  diffuse.only({"diffuseTransmissionFactor", "diffuseTransmissionTexture", "diffuseTransmissionColorFactor",
                "diffuseTransmissionColorTexture"});
  layers.diffuse_transmission = float(diffuse.number("diffuseTransmissionFactor", 0, kUnit));
  layers.diffuse_transmission_color = diffuse.rgb("diffuseTransmissionColorFactor", Rgb(1), kUnit);
  layers.diffuse_transmission_texture =
      read_texture_slot(diffuse, "diffuseTransmissionTexture", TexelEncoding::linear, document);
  layers.diffuse_transmission_color_texture =
      read_texture_slot(diffuse, "diffuseTransmissionColorTexture", TexelEncoding::srgb, document);
}

}  // namespace

double at_least_one(const JsonObject& object, const char* key, double value, const char* allowed) {
  if (value >= 1) return value;
  const std::string problem = "is " + std::to_string(value) + ", allowed: " + allowed;
  constexpr double kHair = 0.01;  // as of a factor in [0, 1]
  if (value >= 1 - kHair)
    object.diagnostics().tolerate(object.place() / key, problem, "read as 1");
  else
    object.diagnostics().fail(object.place() / key, problem);
  return 1;
}

void read_material_layers(const JsonObject& material, const Document& document, MaterialLayers& layers) {
  read_clearcoat(material.extension("KHR_materials_clearcoat"), document, layers);
  read_sheen(material.extension("KHR_materials_sheen"), document, layers);
  read_anisotropy(material.extension("KHR_materials_anisotropy"), document, layers);
  read_iridescence(material.extension("KHR_materials_iridescence"), document, layers);
  read_diffuse_transmission(material.extension("KHR_materials_diffuse_transmission"), document, layers);
}

}  // namespace helio::gltf
